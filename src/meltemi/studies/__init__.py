"""Studies that come with the package: verification and benchmarks."""

KERNELS = ()
