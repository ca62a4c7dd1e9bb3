"""Suites of cases, episodes played in parallel, rows, and what they sum up to."""
