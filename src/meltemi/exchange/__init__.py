"""Import and export of turbine models (OpenFAST, HAWC2, windIO); export of controllers as libraries."""

KERNELS = ()
