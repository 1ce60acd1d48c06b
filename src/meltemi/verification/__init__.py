"""Verification and benchmark: ``meltemi verify`` and ``meltemi bench``. Nothing in meltemi imports this package."""

KERNELS = ()
