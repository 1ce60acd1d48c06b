"""Derivatives of runs: sensitivities with dual numbers, gradients by the adjoint, weights of statistics."""

KERNELS = ()
