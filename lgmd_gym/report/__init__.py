"""One self-contained HTML page per run: scores, grids, detector curves, traces beside what the camera saw."""

from lgmd_gym.report.page import write_report

__all__ = ["write_report"]
