"""Functional mock-up units (FMI 2.0 and 3.0, co-simulation): export of turbines, import of controllers."""

from meltemi.exchange.fmu.controller import fmu_controller as fmu_controller
from meltemi.exchange.fmu.export import export_fmu as export_fmu
