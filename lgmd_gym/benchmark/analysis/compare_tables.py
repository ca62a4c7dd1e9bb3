"""A comparison on the terminal."""

from rich.box import SIMPLE_HEAD
from rich.table import Table

from lgmd_gym.benchmark.analysis.compare import Comparison, Difference


def compare_table(item: Comparison) -> Table:
    """Return one line per quantity: A, B, their difference and interval, and how many pairs differ."""
    caption = "B less A; [95 %, paired bootstrap that draws cases]; pairs in which B is higher / lower, of n"
    if item.alone:
        caption += f"; {item.alone} episodes have no partner (not played, failed, or no threat to the other)"
    title = f"A = {item.a}   B = {item.b}   {item.pairs} pairs {item.condition}".rstrip()
    table = Table(title=title, caption=caption, box=SIMPLE_HEAD)
    table.add_column("quantity")
    for heading in ("A", "B", "B − A", "higher / lower of n"):
        table.add_column(heading, justify="right")
    for line in item.differences:
        pairs = f"{line.better} / {line.worse} of {line.change.n}"
        table.add_row(f"{line.name} [{line.unit}]".replace("[", "\\["), f"{line.a:.2f}", f"{line.b:.2f}",
                      change_text(line).replace("[", "\\["), pairs)  # fmt: skip
    return table


def change_text(line: Difference) -> str:
    """Return a difference with its interval; for pairs that are all alike, how many might yet not be."""
    change = line.change
    if line.other_high is not None:
        return f"{change.value:+.2f} in all pairs (≤ {100 * line.other_high:.0f} % might differ from that)"
    if change.low is None or change.high is None:
        return f"{change.value:+.2f} (one case: no interval)"
    return f"{change.value:+.2f} [{change.low:+.2f}, {change.high:+.2f}]"
