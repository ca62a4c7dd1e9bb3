"""What the package needs of the operating system: whole files, signals, a folder for compiled kernels."""
