"""Self-contained HTML report of a benchmark run."""

from lgmd_gym.benchmark.extensions import OUTPUTS, provide
from lgmd_gym.report.page import write_outputs, write_report

__all__ = ["write_outputs", "write_report"]

provide(OUTPUTS, write_outputs)
