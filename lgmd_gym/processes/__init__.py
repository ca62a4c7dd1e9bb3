"""What the package needs of the operating system: atomic files, locks, signals, worker processes."""
