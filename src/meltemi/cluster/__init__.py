"""More than one machine: pieces of a batch on a Dask cluster, and job scripts for the scheduler of a cluster."""

KERNELS = ()
