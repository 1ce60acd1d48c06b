"""Analyses of turbines, models and results."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
