"""Load cases as data."""

KERNELS = ()
