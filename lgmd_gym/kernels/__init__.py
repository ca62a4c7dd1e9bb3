"""Compiled code: the decorator of all kernels, its cache and progress, and LLVM vectors (`simd`)."""

from lgmd_gym.kernels.kernel import kernel

__all__ = ["kernel"]
