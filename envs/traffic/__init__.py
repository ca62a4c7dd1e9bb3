"""Traffic environments on highway-env's roads and drivers."""
