"""Bladed-style controller libraries as controllers of a run, each in a separate process."""

KERNELS = ()
