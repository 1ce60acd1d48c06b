"""The command line."""

KERNELS = ()
