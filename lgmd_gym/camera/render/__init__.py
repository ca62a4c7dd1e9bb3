"""The compiled kernels that render camera frames, and their lookup tables."""
