"""Turbine descriptions: validated, immutable, in SI units, at the stations of their source."""
