"""Three-dimensional views of turbines: pages, notebook widget, and ``meltemi live``."""

KERNELS = ()
