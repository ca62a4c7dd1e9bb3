"""Self-contained HTML report of a benchmark run."""

from lgmd_gym.report.page import write_report

__all__ = ["write_report"]
