"""Reports as pages, Word and Excel files; figures and tables of theirs; the summary page of a turbine."""

KERNELS = ()
