"""Paired differences between two agents on the same episodes, with cluster bootstrap intervals."""

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

from lgmd_gym.benchmark.folder import read_rows, read_settings
from lgmd_gym.benchmark.rows import Row, RowKey, key_of
from lgmd_gym.benchmark.statistics import Mean, cluster_mean, wilson
from lgmd_gym.benchmark.suites import TRAFFIC
from lgmd_gym.benchmark.summary import without_fcw_driver
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.errors import unknown_name


class Quantity(NamedTuple):
    """Quantity that is compared.

    Attributes:
        name: Name in tables and figures.
        key: Key of the row.
        unit: Unit in tables and figures.
        scale: Factor from SI units to `unit`.
        threats: Whether it is defined for threats or for non-threats.
    """

    name: str
    key: str
    unit: str
    scale: float = 1.0
    threats: bool = True


QUANTITIES = (
    Quantity("avoided", "avoided", "% of threats", 100.0),
    Quantity("speed reduction", "speed_reduction", "km/h", 3.6),
    Quantity("premature braking", "premature_brake", "% of threats", 100.0),
    Quantity("false activation", "false_activation", "% of non-threats", 100.0, threats=False),
    Quantity("TTC at braking", "ttc_at_brake", "s"),
    Quantity("stopping margin", "stopping_margin", "m"),
)


class Difference(NamedTuple):
    """Paired difference B - A of one quantity.

    Attributes:
        name: Name of the quantity.
        unit: Unit of all values.
        mean_a: Mean of A over the pairs.
        mean_b: Mean of B over the pairs.
        change: Mean of B - A with its 95 % interval.
        higher: Number of pairs in which B is higher.
        lower: Number of pairs in which B is lower.
        deviating_high: Upper Wilson bound of the share of pairs with another difference, if all observed
            pairs differ by the same value (their bootstrap interval has no width); else None.
    """

    name: str
    unit: str
    mean_a: float
    mean_b: float
    change: Mean
    higher: int
    lower: int
    deviating_high: float | None


class Comparison(NamedTuple):
    """Paired differences between two agents under one camera condition.

    Attributes:
        name_a: Name of A.
        name_b: Name of B.
        condition: Camera condition; "" if the run has only one.
        pairs: Number of episodes that both completed.
        unpaired: Number of other episodes of either.
        differences: One per quantity that is defined for any pair.
    """

    name_a: str
    name_b: str
    condition: str
    pairs: int
    unpaired: int
    differences: tuple[Difference, ...]


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
    rows_a = _read_case_rows(run_a)
    rows_b = rows_a if run_b is None else _read_case_rows(run_b)
    pairs = _agent_pairs(rows_a, rows_b, agents, run_b is None)
    prefixes = ("", "") if run_b is None else (f"{run_a.name}: ", f"{run_b.name}: ")
    conditions = list(dict.fromkeys(row["condition"] for row in rows_a))
    comparisons = [
        compare_rows(
            [row for row in rows_a if row["agent"] == a and row["condition"] == condition],
            [row for row in rows_b if row["agent"] == b and row["condition"] == condition],
            (prefixes[0] + a, prefixes[1] + b),
            condition if len(conditions) > 1 else "",
        )
        for a, b in pairs
        for condition in conditions
    ]
    if not any(item.pairs for item in comparisons):
        raise ValueError(f"{str(run_a)!r} and {str(run_b)!r} have no episode in common")
    return comparisons


def compare_rows(
    rows_a: list[Row], rows_b: list[Row], names: tuple[str, str], condition: str = ""
) -> Comparison:
    """Compare the rows of two agents; rows of the same case, seed and condition are a pair.

    Cases with a warned driver are left out, as in all totals.
    """
    rows_a, rows_b = without_fcw_driver(rows_a), without_fcw_driver(rows_b)
    by_key_a, by_key_b = _completed_by_key(rows_a), _completed_by_key(rows_b)
    common = sorted(by_key_a.keys() & by_key_b.keys())
    pairs = [(by_key_a[key], by_key_b[key]) for key in common]
    pairs = [(a, b) for a, b in pairs if a["threat"] == b["threat"]]
    unpaired = len({_episode_key(row) for row in (*rows_a, *rows_b)}) - len(pairs)
    differences = (paired_difference(quantity, pairs) for quantity in QUANTITIES)
    return Comparison(*names, condition, len(pairs), unpaired, tuple(filter(None, differences)))


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
    values = [(scale * a[key], scale * b[key]) for a, b in defined]
    changes, n = [b - a for a, b in values], len(values)
    return Difference(
        quantity.name,
        quantity.unit,
        sum(a for a, _ in values) / n,
        sum(b for _, b in values) / n,
        cluster_mean(changes, [a["case"] for a, _ in defined]),
        sum(change > 0 for change in changes),
        sum(change < 0 for change in changes),
        wilson(0, n)[1] if len(set(changes)) == 1 else None,
    )


def _read_case_rows(path: Path) -> list[Row]:
    rows, _ = read_rows(path)
    if read_settings(path)["suite"] == TRAFFIC:
        raise ValueError(
            f"{str(path)!r} is a traffic run, which has no pairs; see the rates per 100 km in its summary.csv"
        )
    return rows


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
            if agent not in known:
                raise unknown_name("agent of the run", agent, known)
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


def _completed_by_key(rows: list[Row]) -> dict[RowKey, Row]:
    return {_episode_key(row): row for row in rows if row["error"] is None}


def _episode_key(row: Row) -> RowKey:
    """Return the key of a row without the agent."""
    return "", *key_of(row)[1:]
