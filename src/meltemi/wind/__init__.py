"""Wind: descriptions, files, turbulence, and the velocity at any point and time."""
