"""Potential flow about platforms: ``meltemi hydro``, with Capytaine."""

KERNELS = ()
