"""Beam sections of blades from their layups: ``meltemi section``."""

KERNELS = ()
