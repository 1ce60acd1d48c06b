"""Turbine-independent basis: errors, units, records, tables, compiled functions."""
