"""Terminal tables of paired differences and of arms."""

from collections.abc import Sequence

from rich.table import Table

from lgmd_gym.benchmark.analysis.compare import Comparison, Difference
from lgmd_gym.benchmark.analysis.trainings import ArmResult, Estimate
from lgmd_gym.benchmark.summary import INTERVAL_TEXT
from lgmd_gym.errors import counted
from lgmd_gym.statistics.intervals import Mean

DIFFERENCE_CAPTION = (
    "B − A [95 % interval, bootstrap over cases and worlds]; number of pairs in which B is higher/lower, of n"
)
ARM_CAPTION = (
    "runs: trainings; return: interquartile mean over them [95 % interval, bootstrap over trainings and "
    "cases; of one training over cases only, of two to four none], below it the lowest and highest training; "
    f"difference: to the first arm, paired by case; shares: means over trainings [{INTERVAL_TEXT}]"
)
SHARE_HEADINGS = {"avoided": "avoided", "premature_brake": "premature", "false_activation": "false"}


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
        cells = (
            f"{item.name} [{item.unit}]",
            f"{item.mean_a:.2f}",
            f"{item.mean_b:.2f}",
            change_text(item),
            pairs,
        )
        table.add_row(*cells)
    return table


def change_text(item: Difference) -> str:
    """Return a difference with its interval, or with the share of pairs that may differ if all are equal."""
    change = item.change
    if item.deviating_high is not None:
        share = f"{100 * item.deviating_high:.0f} %"
        return f"{change.value:+.2f} in all pairs (95 %: at most {share} of pairs differ)"
    if change.low is None:
        return f"{change.value:+.2f} (one case, no interval)"
    return _interval_text(change, "+.2f")


def arm_table(results: Sequence[ArmResult], title: str) -> Table:
    """Return a table with one line per arm; all arms have the same condition."""
    keys = [key for key in SHARE_HEADINGS if key in results[0].shares]
    table = Table(title=title, caption=f"{results[0].sample}; {ARM_CAPTION}")
    table.add_column("arm", min_width=15, overflow="fold")
    for heading in ("runs", "return", "difference\nto the first"):
        table.add_column(heading, justify="right")
    for key in keys:
        heading = f"{SHARE_HEADINGS[key]},\n% of {results[0].shares[key].n}"
        table.add_column(heading, justify="right")
    for result in results:
        mean_return = _interval_text(result.mean_return, ".1f")
        if result.trainings > 1:
            low, high = result.return_range
            mean_return += f"\n{low:.1f} to\n{high:.1f}"
        difference = "–" if result.difference is None else _interval_text(result.difference, "+.1f")
        shares = (_interval_text(result.shares[key], ".0f", 100.0) for key in keys)
        cells = (result.name, str(result.trainings), mean_return, difference, *shares)
        table.add_row(*cells)
    return table


def _interval_text(item: Estimate | Mean, style: str, scale: float = 1.0) -> str:
    """Return a value with its interval, if it has one."""
    value, *bounds = (f"{scale * x:{style}}" for x in item[:3] if x is not None)
    return f"{value} [{','.join(bounds)}]" if bounds else value
