"""Reverse differentiation of compiled code: from LLVM's code of a kernel to that of its adjoint."""
