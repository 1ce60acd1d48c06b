"""Batches on graphics cards: the time loop of many runs at once, compiled by numba-cuda (``device="cuda"``)."""

KERNELS = ()
