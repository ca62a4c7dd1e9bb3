"""Intervals, clustered rates and the bootstrap."""
