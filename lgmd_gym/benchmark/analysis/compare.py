"""Paired differences between two agents on the same episodes, with cluster bootstrap intervals."""

from collections.abc import Iterable, Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.table import Table

from lgmd_gym.benchmark.case import Row, key_of
from lgmd_gym.benchmark.run_folder import read_case_rows
from lgmd_gym.benchmark.summary import Sample, cases_and_worlds, interval_text, without_fcw_driver
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.errors import check_known, counted
from lgmd_gym.plotting.style import COLOURS, FigureFile, saved_figure
from lgmd_gym.statistics.intervals import Mean, Rate, cluster_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DIFFERENCE_CAPTION = (
    "B − A [95 % interval, bootstrap over cases and worlds]; number of pairs in which B is higher/lower, of n"
)


class Quantity(NamedTuple):
    """Row value that is compared, over threats or over non-threats."""

    name: str
    key: str
    unit: str
    scale: float = 1.0  # factor from SI units
    threats: bool = True


QUANTITIES = (
    Quantity("avoided", "avoided", "% of threats", 100.0),
    Quantity("speed reduction", "speed_reduction", "km/h", 3.6),
    Quantity("premature braking", "premature_brake", "% of threats", 100.0),
    Quantity("false activation", "false_activation", "% of non-threats", 100.0, threats=False),
    Quantity("false alert", "false_alert", "% of non-threats", 100.0, threats=False),
    Quantity("TTC at braking", "ttc_at_brake", "s"),
    Quantity("stopping margin", "stopping_margin", "m"),
)


class Difference(NamedTuple):
    """Paired difference B - A of one quantity.

    If all pairs differ by the same value, a bootstrap interval has no width. `deviating_high` is then the
    upper bound of the share of pairs with another difference, see `Rate.clustered`; else it is None.
    """

    name: str
    unit: str
    mean_a: float
    mean_b: float
    change: Mean
    higher: int  # pairs in which B is higher
    lower: int
    deviating_high: float | None


class Comparison(NamedTuple):
    """Paired differences between two agents under one camera condition."""

    name_a: str
    name_b: str
    condition: str  # "" if the run has only one
    sample: Sample  # of the pairs
    pairs: int  # episodes that both completed
    unpaired: int  # other episodes of either
    differences: tuple[Difference, ...]  # of the quantities that are defined for any pair


def compare_runs(run_a: Path, run_b: Path | None, agents: Sequence[str] | None = None) -> list[Comparison]:
    """Compare agents of two run folders, or of one.

    Args:
        run_a: Run folder of A.
        run_b: Run folder of B; None compares agents within `run_a`.
        agents: Agent of A and agent of B. None compares every agent with itself in the other run, or all
            pairs of agents within one run.

    Raises:
        ValueError: For a folder without a run, a traffic run, an unknown agent, or no common episode.
    """
    rows_a = read_case_rows(run_a)
    rows_b = rows_a if run_b is None else read_case_rows(run_b)
    pairs = _agent_pairs(rows_a, rows_b, agents, run_b is None)
    prefixes = ("", "") if run_b is None else (f"{run_a.name}: ", f"{run_b.name}: ")
    comparisons = compare_agents(rows_a, rows_b, pairs, prefixes)
    if not any(item.pairs for item in comparisons):
        raise ValueError(
            f"the agents of {str(run_a)!r} and {str(run_b or run_a)!r} share no completed episode"
        )
    return comparisons


def compare_agents(
    rows_a: list[Row],
    rows_b: list[Row],
    pairs: Iterable[tuple[str, str]],
    prefixes: tuple[str, str] = ("", ""),
) -> list[Comparison]:
    """Compare pairs of agents in each condition of `rows_a`; those without a common episode have no pairs."""
    conditions = list(dict.fromkeys(row["condition"] for row in rows_a))
    return [
        compare_rows(
            [row for row in rows_a if row["agent"] == a and row["condition"] == condition],
            [row for row in rows_b if row["agent"] == b and row["condition"] == condition],
            (prefixes[0] + a, prefixes[1] + b),
            condition if len(conditions) > 1 else "",
        )
        for a, b in pairs
        for condition in conditions
    ]


def compare_rows(
    rows_a: list[Row], rows_b: list[Row], names: tuple[str, str], condition: str = ""
) -> Comparison:
    """Compare the rows of two agents; rows of the same case, seed and condition are a pair.

    Cases with an FCW driver are left out, as in all totals.
    """
    rows_a, rows_b = without_fcw_driver(rows_a), without_fcw_driver(rows_b)
    completed_a, completed_b = (
        {key_of(row)[1:]: row for row in rows if row["error"] is None} for rows in (rows_a, rows_b)
    )
    common = sorted(completed_a.keys() & completed_b.keys())
    pairs = [(completed_a[key], completed_b[key]) for key in common]
    pairs = [(a, b) for a, b in pairs if a["threat"] == b["threat"]]
    unpaired = len({key_of(row)[1:] for row in (*rows_a, *rows_b)}) - len(pairs)
    differences = (paired_difference(quantity, pairs) for quantity in QUANTITIES)
    sample = Sample.of(a for a, _ in pairs)
    return Comparison(*names, condition, sample, len(pairs), unpaired, tuple(filter(None, differences)))


def paired_difference(quantity: Quantity, pairs: list[tuple[Row, Row]]) -> Difference | None:
    """Return the paired difference of a quantity; None if it is undefined for every pair."""
    key, scale = quantity.key, quantity.scale
    defined = [
        (a, b)
        for a, b in pairs
        if a["threat"] is quantity.threats and a.get(key) is not None and b.get(key) is not None
    ]
    if not defined:
        return None
    values: list[tuple[float, float]] = [(scale * a[key], scale * b[key]) for a, b in defined]
    changes, n = [b - a for a, b in values], len(values)
    clusters = cases_and_worlds(a for a, _ in defined)
    return Difference(
        quantity.name,
        quantity.unit,
        sum(a for a, _ in values) / n,
        sum(b for _, b in values) / n,
        cluster_mean(changes, *clusters),
        sum(change > 0 for change in changes),
        sum(change < 0 for change in changes),
        Rate.clustered([False] * n, *clusters).high if len(set(changes)) == 1 else None,
    )


def _agent_pairs(
    rows_a: list[Row], rows_b: list[Row], agents: Sequence[str] | None, within: bool
) -> list[tuple[str, str]]:
    """Return the pairs of agents to compare."""
    agents_a = list(dict.fromkeys(row["agent"] for row in rows_a))
    agents_b = list(dict.fromkeys(row["agent"] for row in rows_b))
    if agents is not None:
        if len(agents) != 2:
            raise ValueError(f"agents must be two, one of A and one of B, got {len(agents)}")
        for agent, known in zip(agents, (agents_a, agents_b), strict=True):
            check_known("agent of the run", agent, known)
        return [(agents[0], agents[1])]
    if within:
        pairs = list(combinations([agent for agent in agents_a if agent != NO_BRAKE], 2))
    else:
        pairs = [(agent, agent) for agent in agents_a if agent in agents_b and agent != NO_BRAKE]
    if not pairs:
        raise ValueError(
            f"no pair of agents in {', '.join(agents_a)} and {', '.join(agents_b)}; name two with --agents"
        )
    return pairs


def comparison_table(comparison: Comparison) -> Table:
    """Return a table with one line per quantity: A, B, their difference, and how many pairs differ."""
    caption = f"{comparison.sample}; {DIFFERENCE_CAPTION}"
    if comparison.unpaired:
        episodes = counted(comparison.unpaired, "episode")
        caption += f"; {episodes} without a pair (missing, failed, or threat to one only)"
    title = f"A = {comparison.name_a}   B = {comparison.name_b}   {comparison.pairs} pairs"
    table = Table(title=f"{title} {comparison.condition}".rstrip(), caption=caption)
    table.add_column("quantity")
    for heading in ("A", "B", "B − A", "higher/lower\nof n"):
        table.add_column(heading, justify="right")
    for item in comparison.differences:
        pairs = f"{item.higher}/{item.lower} of {item.change.n}"
        means = f"{item.mean_a:.2f}", f"{item.mean_b:.2f}"
        table.add_row(f"{item.name} [{item.unit}]", *means, change_text(item), pairs)
    return table


def change_text(item: Difference) -> str:
    """Return a difference with its interval, or with the share of pairs that may differ if all are equal."""
    change = item.change
    if item.deviating_high is not None:
        share = f"{100 * item.deviating_high:.0f} %"
        return f"{change.value:+.2f} in all pairs (95 %: at most {share} of pairs differ)"
    if change.low is None:
        return f"{change.value:+.2f} (one case, no interval)"
    return interval_text(change, "+.2f")


def difference_figure(file: FigureFile, comparisons: list[Comparison]) -> "Figure":
    """Plot and save paired differences with their 95 % intervals, one panel per quantity."""
    names = list(dict.fromkeys(item.name for comparison in comparisons for item in comparison.differences))
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    size = (10.0, rows * (1.1 + 0.42 * len(comparisons)))
    with saved_figure(file, rows, columns, figsize=size, squeeze=False) as (figure, axes):
        for axis in axes.flat[len(names) :]:
            axis.set_visible(False)
        for index, (name, axis) in enumerate(zip(names, axes.flat, strict=False)):
            _plot_differences(axis, name, comparisons, labels=index % columns == 0)
    return figure


def _plot_differences(axis: Any, name: str, comparisons: list[Comparison], labels: bool) -> None:
    """Plot one quantity; comparison i is at y = i."""
    axis.axvline(0.0, color="0.4", linewidth=1.0)
    unit = ""
    for height, comparison in enumerate(comparisons):
        item = next((item for item in comparison.differences if item.name == name), None)
        if item is None:
            continue
        unit, change = item.unit, item.change
        if change.low is not None and change.high is not None:
            ends = [change.low, change.high]
            axis.plot(ends, [height, height], color=COLOURS[2], linewidth=2.5, solid_capstyle="butt")
        axis.plot(change.value, height, "o", color=COLOURS[2], markersize=5)
    axis.set_title(name, fontsize=9)
    axis.set_xlabel(f"B − A [{unit}]", fontsize=8)
    axis.set_ylim(len(comparisons) - 0.5, -0.5)
    texts = [_comparison_label(comparison) for comparison in comparisons] if labels else []
    axis.set_yticks(range(len(comparisons)), texts, fontsize=7)


def _comparison_label(item: Comparison) -> str:
    return f"{item.name_b}\n− {item.name_a}" + (f"\n{item.condition}" if item.condition else "")
