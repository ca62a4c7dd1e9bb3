"""Tables and the figure of the comparison: terminal, Markdown, CSV and PNG."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from comparison import Comparison, DriveValues
from drive_statistics import STATISTICS
from rich.table import Table

from lgmd_gym.plotting.style import COLOURS, saved_figure

COLUMNS = ("statistic", "real: min / median / max", "simulated: p5 / median / p95", "real inside",
           "median inside", "distance")  # fmt: skip
CAPTION = (
    "real inside: real values between the 5th and 95th percentile of the simulated ones. median inside: "
    "whether the real median is between them. distance: "
    "Wasserstein-1 distance of the two samples, divided by the range of all values (0 equal, 1 separate)."
)


def comparison_tables(comparisons: Sequence[Comparison]) -> list[Table]:
    """Return one terminal table per group."""
    tables = []
    for group, rows in _groups(comparisons).items():
        table = Table(title=_title(group, rows), caption=CAPTION)
        table.add_column(COLUMNS[0])
        for name in COLUMNS[1:]:
            table.add_column(name, justify="right")
        for cells in map(_cells, rows):
            table.add_row(*cells)
        table.add_section()
        table.add_row(*_total(rows))
        tables.append(table)
    return tables


def write_comparisons(comparisons: Sequence[Comparison], drives: Sequence[DriveValues], folder: Path) -> None:
    """Write realism.md and realism.csv (comparisons) and drives.csv (the values of every drive)."""
    lines = []
    for group, rows in _groups(comparisons).items():
        lines += [
            f"## {_title(group, rows)}",
            "",
            "| " + " | ".join(COLUMNS) + " |",
            "|" + "---|" * len(COLUMNS),
        ]
        lines += ["| " + " | ".join(cells) + " |" for cells in (*map(_cells, rows), _total(rows))]
        lines.append("")
    (folder / "realism.md").write_text(
        "\n".join((*lines, summary_line(comparisons), "", CAPTION)) + "\n", encoding="utf-8"
    )
    header = ("group", "statistic", "unit", "real_min", "real_median", "real_max", "simulated_p5",
              "simulated_median", "simulated_p95", "inside", "median_inside", "clips", "drives",
              "distance")  # fmt: skip
    _write(folder / "realism.csv", header, [
        (row.group, row.statistic, STATISTICS[row.statistic].unit,
         *map(_number, (row.real[0], np.median(row.real), row.real[-1])),
         *map(_number, (row.low, np.median(row.simulated), row.high)),
         row.inside, int(row.median_inside), len(row.real), len(row.simulated), _number(row.distance))
        for row in comparisons
    ])  # fmt: skip
    _write(folder / "drives.csv", ("name", "group", "kind", *STATISTICS), [
        (item.name, item.group, "real" if item.real else "simulated", *map(_number, item.values.values()))
        for item in drives
    ])  # fmt: skip


def summary_line(comparisons: Sequence[Comparison]) -> str:
    """Return how many statistics of each group have the real median inside the simulated range."""
    groups = _groups(comparisons)
    counts = [
        f"{group} {sum(row.median_inside for row in rows)} of {len(rows)}" for group, rows in groups.items()
    ]
    return f"Statistics with the real median inside the simulated 5–95 % range: {', '.join(counts)}"


def _groups(comparisons: Sequence[Comparison]) -> dict[str, list[Comparison]]:
    groups: dict[str, list[Comparison]] = {}
    for row in comparisons:
        groups.setdefault(row.group, []).append(row)
    return groups


def _title(group: str, rows: Sequence[Comparison]) -> str:
    clips, drives = (max(len(getattr(row, kind)) for row in rows) for kind in ("real", "simulated"))
    return f"{group}: {clips} real clips, {drives} simulated drives"


def _cells(row: Comparison) -> tuple[str, ...]:
    label, unit = STATISTICS[row.statistic]
    real = (row.real[0], np.median(row.real), row.real[-1])
    simulated = (row.low, np.median(row.simulated), row.high)
    return (
        f"{label} ({unit})" if unit else label,
        " / ".join(map(_text, real)), " / ".join(map(_text, simulated)),
        f"{row.inside} of {len(row.real)}", "yes" if row.median_inside else "no", f"{row.distance:.2f}",
    )  # fmt: skip


def _total(rows: Sequence[Comparison]) -> tuple[str, ...]:
    inside, values = sum(row.inside for row in rows), sum(len(row.real) for row in rows)
    medians = f"{sum(row.median_inside for row in rows)} of {len(rows)}"
    return "all", "", "", f"{inside} of {values}", medians, f"{np.mean([row.distance for row in rows]):.2f}"


def _text(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 20.0 or value == round(value) else f"{value:.1f}"


def _number(value: float) -> str:
    return f"{value:.6g}"


def _write(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(rows)


REAL, SIMULATED = COLOURS[1], COLOURS[2]
PANELS = 4  # in a row


def realism_figure(comparisons: Sequence[Comparison], path: Path) -> None:
    """Draw one panel per statistic: simulated drives as a strip with their 5-95 % range, clips as dots."""
    groups = list(dict.fromkeys(row.group for row in comparisons))
    lines = -(-len(STATISTICS) // PANELS)
    size = (13.0, lines * (1.0 + 0.7 * len(groups)))
    with saved_figure(path, lines, PANELS, figsize=size) as (figure, axes):
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
