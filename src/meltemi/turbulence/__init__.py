"""Turbulent fields: random numbers, spectra, coherence, and their synthesis on a grid."""

FEATURE = "turbulent wind"
