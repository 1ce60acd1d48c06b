"""Scaling of a reference turbine to main parameters."""
