"""Bladed-style controller libraries as controllers of a run, each in a process of its own."""

KERNELS = ()
