"""Inflow: what the user describes, files, and the velocity at any point and time."""
