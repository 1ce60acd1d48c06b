"""Constants of air: gas constants, and temperatures."""

R_DRY, R_VAPOUR = 287.058, 461.495
"""[J/(kg K)] gas constants of dry air and water vapour."""
CELSIUS, STANDARD_TEMPERATURE = 273.15, 15.0
"""Absolute temperature [K] of 0 degrees Celsius; temperature [degC] of the ISO 2533 atmosphere at sea level."""
