"""Loads: statistics, fatigue, spectra, means over seeds with their confidence; load bases and surrogates in the
packages below."""

from meltemi.namespaces import public

KERNELS = ()

__getattr__, __dir__ = public(__name__)
