"""Traffic environments on highway-env's roads and drivers, with registered ids `LGMD/Traffic-<Kind>-v0`."""
