"""Shapes, motion, loads and wind of a run for the three-dimensional view."""

KERNELS = ()
