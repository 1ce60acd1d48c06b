"""Controllers by name, common to commands, case files and Python; tuning of control schemes."""

KERNELS = ()
