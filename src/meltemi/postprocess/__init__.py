"""Evaluation of results: statistics, fatigue, spectra, files."""

KERNELS = ("counting.py",)
