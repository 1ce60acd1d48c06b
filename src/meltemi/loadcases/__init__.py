"""Batches of runs on all cores, and what they keep."""

KERNELS = ()
