"""What the protocols would make of a row: limits, colours, contact. Protocol-derived, and no rating."""

from collections.abc import Callable
from typing import Any, NamedTuple

from lgmd_gym.benchmark.summary import Rate, case_order
from lgmd_gym.envs.dynamics.units import KMH

Row = dict[str, Any]

# UN R152 Rev.2, 5.2.1.4, M1: relative speed -> highest relative impact speed, both in km/h; between two rows
# the higher one's limit holds.
R152_SPEEDS = (40, 42, 45, 50, 55, 60)
R152_LIMITS = {"laden": (0, 10, 15, 25, 30, 35), "unladen": (0, 0, 15, 25, 30, 35)}
R152_SHARE = 0.10  # of the runs may fail (6.10.1)

# Euro NCAP Frontal Collisions 2026, 5.3.1: upper edges of the colours, relative impact speed in km/h, by the
# ego's test speed; an edge belongs to the worse colour.
COLOURS = ("green", "yellow", "orange", "brown", "red")
BANDS_2026 = {
    20: (("green", 0.0),),
    30: (("green", 0.0), ("brown", 10.0)),
    40: (("green", 0.0), ("orange", 10.0), ("brown", 20.0)),
    50: (("green", 0.0), ("yellow", 10.0), ("orange", 20.0), ("brown", 30.0)),
}
WEIGHTS = {"green": 1.0, "yellow": 0.75, "orange": 0.5, "brown": 0.25, "red": 0.0}


class Verdict(NamedTuple):
    """One agent in one case of a protocol.

    Attributes:
        agent: The agent's string.
        case: The case's name.
        demand: What the protocol asks, in words.
        met: Runs that meet it.
        worst: Highest relative impact speed [m/s].
    """

    agent: str
    case: str
    demand: str
    met: Rate
    worst: float


def impact(row: Row) -> float:
    """Return a row's relative impact speed [m/s]; 0 without contact."""
    return row["relative_impact_speed"] or 0.0


def r152_limit(relative_kmh: float, load: str) -> float:
    """Return the highest relative impact speed that UN R152 allows an M1 car [km/h].

    Args:
        relative_kmh: Relative speed at the start, in [0, 60] [km/h].
        load: "laden" (maximum mass) or "unladen" (running order).

    Raises:
        ValueError: Beyond 60 km/h, where the regulation sets no limit.
    """
    for speed, limit in zip(R152_SPEEDS, R152_LIMITS[load], strict=True):
        if relative_kmh <= speed + 1e-6:
            return float(limit)
    raise ValueError(f"UN R152 sets no limit at {relative_kmh:g} km/h relative speed; it ends at 60")


def r152_load(case: str) -> str:
    """Return the load state a case of suite r152 is judged by: 40 km/h is driven laden, the rest in both."""
    return "laden" if case.endswith("CCRs/v40") else "unladen"


def colour_2026(ego_kmh: float, impact_kmh: float) -> str:
    """Return the colour of a relative impact speed under Euro NCAP 2026.

    Example:
        >>> [colour_2026(50, speed) for speed in (0, 9.9, 10, 35)]
        ['green', 'yellow', 'orange', 'red']
    """
    row = min(max(10 * int(ego_kmh / 10 + 1e-6), 20), 50)
    if impact_kmh <= 0.0:
        return "green"
    for colour, edge in BANDS_2026[row]:
        if impact_kmh < edge:
            return colour
    return "red"


def verdicts(rows: list[Row], agent: str, judge: Callable[[Row], tuple[bool, str]]) -> list[Verdict]:
    """Return one verdict per case of an agent; `judge` says of a row whether it meets what demand."""
    found = []
    played = [row for row in rows if row["agent"] == agent and row["error"] is None and row["threat"]]
    for case in sorted({row["case"] for row in played}, key=case_order):
        of_case = [row for row in played if row["case"] == case]
        demands = {judge(row)[1] for row in of_case}
        met = Rate.of(judge(row)[0] for row in of_case)
        found.append(Verdict(agent, case, " / ".join(sorted(demands)), met, max(map(impact, of_case))))
    return found


def judge_r152(row: Row) -> tuple[bool, str]:
    """Judge a row of suite r152 by the impact-speed limit of its relative speed and load."""
    relative = round((row["ego_speed"] - row["target_speed"]) / KMH, 3)
    load = r152_load(row["case"])
    limit = r152_limit(relative, load)
    good = impact(row) / KMH <= limit + 1e-9
    # Who brakes before the test has begun (T0) has not been tested.
    return good and not row["premature_brake"], f"≤ {limit:g} km/h {load}"


def judge_contact(row: Row) -> tuple[bool, str]:
    """Judge a row of suite fmvss127: no contact (49 CFR 571.127 S5.1.3)."""
    return not row["collision"], "no contact"


def judge_colour(row: Row) -> tuple[bool, str]:
    """Judge a row of suite ncap2026: green."""
    return colour_2026(row["ego_speed"] / KMH, impact(row) / KMH) == "green", "green"


JUDGES: dict[str, Callable[[Row], tuple[bool, str]]] = {
    "r152": judge_r152,
    "fmvss127": judge_contact,
    "ncap2026": judge_colour,
}


def meets_r152(rows: list[Row], agent: str) -> bool:
    """Return whether an agent meets the impact-speed limits of UN R152 5.2.1.4 in simulation.

    Judged as 6.10.1 counts runs: at most 10 % of all failed.
    """
    found = verdicts(rows, agent, judge_r152)
    runs, met = sum(item.met.n for item in found), sum(item.met.k for item in found)
    return runs > 0 and runs - met <= R152_SHARE * runs
