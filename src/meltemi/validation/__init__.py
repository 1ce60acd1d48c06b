"""Comparison of measured ten-minute records with simulations: files of measurements, their faults, their selection."""

KERNELS = ()
