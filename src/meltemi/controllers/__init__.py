"""Controllers by name: one vocabulary for commands, case files and Python; tuning of control schemes."""

KERNELS = ()
