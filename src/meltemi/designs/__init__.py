"""Design by gradients: variables of turbine and controller, objectives over many runs, optimisers, report."""

KERNELS = ()
