"""Arms on the terminal."""

from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from lgmd_gym.benchmark.judge import Arm, Share

CAPTION = (
    "return: interquartile mean over trainings [95 %, stratified bootstrap of trainings and episodes]; "
    "shares: mean over trainings of n episodes [Wilson 95 % interval, each episode once]"
)


def judge_table(arms: Sequence[Arm], title: str) -> Table:
    """Return one line per arm."""
    table = Table(title=title, caption=CAPTION, box=SIMPLE_HEAD)
    table.add_column("arm")
    for heading in ("trainings", "return", "lowest, highest", "avoided", "premature", "false braking"):
        table.add_column(heading, justify="right")
    for arm in arms:
        value = f"{arm.value:.2f} [{arm.low:.2f}, {arm.high:.2f}]"
        spread = f"{arm.spread[0]:.2f}, {arm.spread[1]:.2f}" if arm.trainings > 1 else "–"
        shares = (_told(item) for item in (arm.avoided, arm.premature, arm.false_brakes))
        cells = (arm.name, str(arm.trainings), value, spread, *shares)
        table.add_row(*(cell.replace("[", "\\[") for cell in cells))
    return table


def _told(share: Share | None) -> str:
    if share is None:
        return "–"
    value, low, high, n = share
    return f"{100 * value:.1f} % of {n} [{100 * low:.0f}–{100 * high:.0f}]"
