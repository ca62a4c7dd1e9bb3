"""Analysis of finished runs: protocol limits, comparisons, detection curves, tables and figures."""
