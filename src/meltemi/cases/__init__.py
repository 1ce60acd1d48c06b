"""Cases: a run with its turbine, wind and controller as a record and a YAML file."""

KERNELS = ()
