"""Plots and tables."""

KERNELS = ()
