"""Scaling of a reference turbine to main parameters."""

from meltemi.turbine.scaling.turbine import scale_turbine as scale_turbine
from meltemi.turbine.scaling.typical import ComponentMasses as ComponentMasses
from meltemi.turbine.scaling.typical import typical_masses as typical_masses
