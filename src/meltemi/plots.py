"""Figures of results, turbines, winds and analyses."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
