"""Batches of runs on all cores, and stores of their results."""

KERNELS = ()
