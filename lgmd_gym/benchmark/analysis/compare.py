"""Two agents on the same episodes: paired differences, with intervals from a bootstrap that draws cases."""

from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

from lgmd_gym.benchmark.folder import read_rows, read_settings
from lgmd_gym.benchmark.rows import key_of
from lgmd_gym.benchmark.statistics import Mean, cluster_mean
from lgmd_gym.benchmark.summary import automatic, wilson
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.benchmark.traffic.rows import SUITE as TRAFFIC
from lgmd_gym.errors import unknown_name

Row = dict[str, Any]
# What is compared -> its key in the rows, unit, and factor from SI.
QUANTITIES = {
    "avoided": ("avoided", "% of threats", 100.0),
    "speed reduction": ("speed_reduction", "km/h", 3.6),
    "premature braking": ("premature_brake", "% of threats", 100.0),
    "false braking": ("false_activation", "% of quiet episodes", 100.0),
    "TTC at braking": ("ttc_at_brake", "s", 1.0),
    "least distance": ("stopping_margin", "m", 1.0),
}
OVER_THREATS = ("avoided", "speed_reduction", "premature_brake", "ttc_at_brake", "stopping_margin")


class Difference(NamedTuple):
    """One quantity, B less A, over the episodes in which both have it.

    Attributes:
        name: Of the quantity.
        unit: Of everything below.
        a: Mean of A.
        b: Mean of B.
        change: Mean of B less A, with its interval.
        better: Pairs in which B is higher.
        worse: Pairs in which B is lower.
        other_high: If all pairs differ by the same: the Wilson bound of the share of pairs that might not,
            which is all that n like pairs can exclude (a bootstrap of them has no width); None otherwise.
    """

    name: str
    unit: str
    a: float
    b: float
    change: Mean
    better: int
    worse: int
    other_high: float | None


class Comparison(NamedTuple):
    """Two agents over their common episodes.

    Attributes:
        a: What A is called.
        b: What B is called.
        condition: The camera's, if the run has several; else "".
        pairs: Number of common episodes.
        alone: Episodes that only one of them has, or has without an error.
        differences: One per quantity that any pair has.
    """

    a: str
    b: str
    condition: str
    pairs: int
    alone: int
    differences: tuple[Difference, ...]


def compare_runs(run_a: Path, run_b: Path | None, agents: tuple[str, ...] | None = None) -> list[Comparison]:
    """Compare the agents of two run folders, or within one.

    Args:
        run_a: Run folder.
        run_b: Another; None for agents within the first.
        agents: A's agent and B's; None for every agent that both runs hold (within one run: all pairs).

    Raises:
        ValueError: For a folder without a run, a traffic run, an agent that a run does not hold, or nothing
            in common.
    """
    rows_a = _rows(run_a)
    rows_b = rows_a if run_b is None else _rows(run_b)
    pairs = _pairs(rows_a, rows_b, agents, run_b is None)
    names = ("", "") if run_b is None else (f"{run_a.name}: ", f"{run_b.name}: ")
    conditions = list(dict.fromkeys(row["condition"] for row in rows_a))
    found = [
        compare_rows(
            [row for row in rows_a if row["agent"] == a and row["condition"] == condition],
            [row for row in rows_b if row["agent"] == b and row["condition"] == condition],
            (names[0] + a, names[1] + b),
            condition if len(conditions) > 1 else "",
        )
        for a, b in pairs
        for condition in conditions  # apart: the mean over a steady and a shaken lens says nothing of either
    ]
    if not any(item.pairs for item in found):
        raise ValueError(f"{str(run_a)!r} and {str(run_b)!r} have no episode in common; nothing to compare")
    return found


def compare_rows(
    rows_a: list[Row], rows_b: list[Row], names: tuple[str, str], condition: str = ""
) -> Comparison:
    """Compare one agent's rows with another's: same case, seed and condition make a pair.

    Cases in which a warned driver brakes are left out, as they are of all totals.
    """
    rows_a, rows_b = automatic(rows_a), automatic(rows_b)
    played_a, played_b = _by_key(rows_a), _by_key(rows_b)
    common = sorted(played_a.keys() & played_b.keys())
    pairs = [(played_a[key], played_b[key]) for key in common]
    pairs = [(a, b) for a, b in pairs if a["threat"] == b["threat"]]
    alone = len(_keys(rows_a) | _keys(rows_b)) - len(pairs)
    found = (difference(name, pairs) for name in QUANTITIES)
    return Comparison(*names, condition, len(pairs), alone, tuple(item for item in found if item is not None))


def difference(name: str, pairs: list[tuple[Row, Row]]) -> Difference | None:
    """Return the paired difference of one of `QUANTITIES`; None if no pair has it."""
    key, unit, factor = QUANTITIES[name]
    wanted = [
        (a, b)
        for a, b in pairs
        if a["threat"] is (key in OVER_THREATS) and a.get(key) is not None and b.get(key) is not None
    ]
    if not wanted:
        return None
    values = [(factor * a[key], factor * b[key]) for a, b in wanted]
    changes = [b - a for a, b in values]
    n, better, worse = len(values), sum(x > 0 for x in changes), sum(x < 0 for x in changes)
    return Difference(
        name,
        unit,
        sum(a for a, _ in values) / n,
        sum(b for _, b in values) / n,
        cluster_mean(changes, [a["case"] for a, _ in wanted]),
        better,
        worse,
        wilson(0, n)[1] if len(set(changes)) == 1 else None,
    )


def _rows(path: Path) -> list[Row]:
    rows, _ = read_rows(path)
    if read_settings(path)["suite"] == TRAFFIC:
        raise ValueError(f"{str(path)!r} is a traffic run; its rates per 100 km are in its summary.csv")
    return rows


def _pairs(
    rows_a: list[Row], rows_b: list[Row], agents: tuple[str, ...] | None, within: bool
) -> list[tuple[str, str]]:
    """Return the pairs of agents to compare."""
    of_a = list(dict.fromkeys(row["agent"] for row in rows_a))
    of_b = list(dict.fromkeys(row["agent"] for row in rows_b))
    if agents is not None:
        if len(agents) != 2:
            raise ValueError(f"--agents takes two, A's and B's, got {len(agents)}")
        for agent, known in zip(agents, (of_a, of_b), strict=True):
            if agent not in known:
                raise unknown_name("agent of the run", agent, known)
        return [(agents[0], agents[1])]
    if within:
        pairs = list(combinations([agent for agent in of_a if agent != NO_BRAKE], 2))
    else:
        pairs = [(agent, agent) for agent in of_a if agent in of_b and agent != NO_BRAKE]
    if not pairs:
        raise ValueError(
            f"no agents to pair among {', '.join(of_a)} and {', '.join(of_b)}; name two: --agents"
        )
    return pairs


def _by_key(rows: list[Row]) -> dict[tuple[Any, ...], Row]:
    return {key_of(row)[1:]: row for row in rows if row["error"] is None}


def _keys(rows: list[Row]) -> set[tuple[Any, ...]]:
    return {key_of(row)[1:] for row in rows}
