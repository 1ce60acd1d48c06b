"""Controllers tuned, compared in the same wind fields, and tested on a bench; runs that a study keeps."""

KERNELS = ()
