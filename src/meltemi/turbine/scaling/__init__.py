"""Scaling of a reference turbine to main parameters."""

from meltemi.turbine.scaling.turbine import scale_turbine as scale_turbine
from meltemi.turbine.scaling.typical import Masses as Masses
from meltemi.turbine.scaling.typical import typical_masses as typical_masses
