"""Scaling of a reference turbine to other main parameters."""
