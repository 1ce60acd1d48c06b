"""Kinds of rotors, see ``simulation.rotors``: a module each, with ``KIND``."""

KERNELS = ()
