"""Foundations that know nothing about turbines: errors, units, records, tables, compiled functions."""
