"""Turbine descriptions: validated, immutable, in SI units, at the stations of their source."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)

KERNELS = ("exchange.py",)
