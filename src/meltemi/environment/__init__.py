"""The air and the ground the turbine stands in."""
