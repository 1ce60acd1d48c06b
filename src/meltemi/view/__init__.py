"""The turbine in three dimensions: pages, notebook widget, and ``meltemi live``."""

KERNELS = ()
