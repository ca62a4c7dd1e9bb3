"""Tables of `lgmd-gym paper --realism`: terminal, Markdown and CSV."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.table import Table

from lgmd_gym.paper.realism import Comparison, DriveValues
from lgmd_gym.paper.realism_statistics import STATISTICS

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
