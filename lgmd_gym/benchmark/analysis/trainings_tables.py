"""Arms on the terminal."""

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from lgmd_gym.benchmark.analysis.trainings import Arm, Estimate

CAPTION = (
    "return: interquartile mean over trainings (below: worst to best); [95 %: trainings and cases drawn; of "
    "one training cases alone, of two to four none]; less the first: paired by case; shares: means"
)
SHARES = {"avoided": "avoided", "premature_brake": "premature", "false_activation": "false"}


def judge_table(arms: Sequence[Arm], title: str) -> Table:
    """Return one line per arm; the arms are of one condition, and so of the same cases."""
    shares = [key for key in SHARES if key in arms[0].shares]
    table = Table(title=title, caption=CAPTION, box=SIMPLE_HEAD)
    table.add_column("arm", min_width=15, overflow="fold")
    for heading in ("train-\nings", "return", "less the\nfirst"):
        table.add_column(heading, justify="right", no_wrap=True)
    for key in shares:
        table.add_column(f"{SHARES[key]},\n% of {arms[0].shares[key].n}", justify="right", no_wrap=True)
    for arm in arms:
        less = "–" if arm.less_first is None else _told(arm.less_first, "+.1f")
        told = (_told(arm.shares[key], ".0f", 100.0) for key in shares)
        returned = _told(arm.returned, ".1f")
        if arm.trainings > 1:
            returned += f"\n{arm.spread[0]:.1f} to {arm.spread[1]:.1f}"
        cells = (arm.name, str(arm.trainings), returned, less, *told)
        table.add_row(*(cell.replace("[", "\\[") for cell in cells))
    return table


def _told(item: Estimate, style: str, factor: float = 1.0) -> str:
    value = f"{factor * item.value:{style}}"
    if item.low is None or item.high is None:
        return value
    return f"{value} [{factor * item.low:{style}}, {factor * item.high:{style}}]"
