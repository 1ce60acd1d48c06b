"""The number types that kernels can be compiled for."""
