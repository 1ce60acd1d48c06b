"""Scaling of a reference turbine to main parameters."""

from meltemi.turbine.scaling.turbine import scale_turbine as scale_turbine
