"""Controllers and actuators."""
