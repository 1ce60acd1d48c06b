"""Turbines of other programs in and out: OpenFAST, HAWC2, windIO; controllers out, as libraries."""

KERNELS = ()
