"""Loads: statistics, fatigue, spectra, and means over seeds with their confidence."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
