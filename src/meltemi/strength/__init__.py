"""Stresses and strength: ``meltemi stress``; fatigue of tower welds, plies of blade sections, buckling of spar caps."""

KERNELS = ()
