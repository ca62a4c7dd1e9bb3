"""The figure of `lgmd-gym paper --realism`; matplotlib is imported on first use."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.paper.realism import Comparison
from lgmd_gym.paper.realism_statistics import STATISTICS
from lgmd_gym.plotting.style import COLOURS, saved_figure

REAL, SIMULATED = COLOURS[1], COLOURS[2]
COLUMNS = 4


def realism_figure(comparisons: Sequence[Comparison], path: Path) -> None:
    """Draw one panel per statistic: simulated drives as a strip with their 5-95 % range, clips as dots."""
    groups = list(dict.fromkeys(row.group for row in comparisons))
    lines = -(-len(STATISTICS) // COLUMNS)
    size = (13.0, lines * (1.0 + 0.7 * len(groups)))
    with saved_figure(path, lines, COLUMNS, figsize=size) as (figure, axes):
        for axis in axes.flat[len(STATISTICS) :]:
            axis.set_axis_off()
        for axis, (name, (label, unit)) in zip(axes.flat, STATISTICS.items(), strict=False):
            axis.set_title(f"{label} [{unit}]" if unit else label, fontsize=9)
            axis.set_yticks(range(len(groups)), groups)
            axis.set_ylim(len(groups) - 0.5, -0.5)
            axis.grid(axis="y", visible=False)
            for row in comparisons:
                if row.statistic == name:
                    _draw_row(axis, groups.index(row.group), row)
        handles, labels = axes.flat[0].get_legend_handles_labels()
        known = dict(zip(labels, handles, strict=True))
        figure.legend(known.values(), known, loc="outside lower center", ncols=len(known))


def _draw_row(axis: Any, line: int, row: Comparison) -> None:
    """Draw one group of a statistic: simulated above, real below the line."""
    jitter = 0.12 * np.linspace(-1.0, 1.0, 7)[np.arange(len(row.simulated)) % 7]
    axis.plot(
        [row.low, row.high], [line - 0.2] * 2, color=SIMULATED, linewidth=9, alpha=0.25,
        solid_capstyle="butt", label="simulated, 5-95 %",
    )  # fmt: skip
    axis.scatter(row.simulated, line - 0.2 + jitter, s=7, color=SIMULATED, alpha=0.6, label="simulated drive")
    axis.scatter(
        row.real, np.full(len(row.real), line + 0.2), s=32, color=REAL, edgecolors="white", linewidths=0.5,
        zorder=3, label="real clip",
    )  # fmt: skip
