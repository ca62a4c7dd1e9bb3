"""Points after Euro NCAP, protocol-derived and no rating: only what the public numbers give.

2023 (Assessment Protocol Collision Avoidance v10.4.1, 3.3.2): the colour bands are public as numbers for
50 km/h alone; at other speeds a contact counts as nothing, so that the points are a lower bound. CCCscp is
left out. 2026 (Frontal Collisions v1.1, 5.3): the standard range of the rear scenarios; of the robustness
layer and the extended range too little is built to score.
"""

import re
from collections.abc import Callable
from typing import Any, NamedTuple

from lgmd_gym.benchmark.analysis.protocol_limits import WEIGHTS, colour_2026, impact
from lgmd_gym.envs.dynamics.units import KMH

Row = dict[str, Any]
CELL = re.compile(
    r"/(?P<family>CCR[smb])/v(?P<speed>\d+)(?P<warned>-warned)?/(overlap|location)(?P<place>-?\d+)$"
)
BRAKING_LEAD = re.compile(r"/CCRb/v50/brake\d+-gap\d+$")
BANDS_2023_50 = (("green", 5.0), ("yellow", 15.0), ("orange", 30.0), ("brown", 40.0))  # upper edges, km/h
OVERLAP_WEIGHTS = {-50: 1, -75: 1, 100: 2, 75: 1, 50: 1}
POINTS_2023 = {
    "CCRs": {10: 1, 15: 2, 20: 2, 25: 2, 30: 2, 35: 2, 40: 1, 45: 1, 50: 1},
    "CCRs, warned driver": dict.fromkeys(range(55, 85, 5), 1),
    "CCRm": {speed: 1 if speed <= 60 else 2 for speed in range(30, 85, 5)},
}
TOTALS_2026 = {"CCRs": 1.2, "CCRm": 2.4, "CCRb": 1.6}  # standard range
GATE = 20.0  # km/h: CCRs counts only if all contact up to here is avoided
UNKNOWN = "contact"  # a contact whose colour is not public


class Points(NamedTuple):
    """Points of one scenario.

    Attributes:
        scenario: Its name.
        earned: Mean over seeds.
        of: Highest possible.
        exact: False for a lower bound.
        note: Why nothing was earned, or "".
    """

    scenario: str
    earned: float
    of: float
    exact: bool
    note: str = ""


def colour_2023(row: Row) -> str:
    """Return the colour of a row of suite ncap2023, or `UNKNOWN` for a contact at another speed than 50 km/h.

    Judged by the impact speed in CCRs and CCRb, by the relative one in CCRm.
    """
    if not row["collision"]:
        return "green"
    family = row["case"].split("/")[1]
    if round(row["ego_speed"] / KMH) != 50 or family not in ("CCRs", "CCRb"):
        return UNKNOWN
    speed = row["impact_speed"] / KMH
    return next((colour for colour, edge in BANDS_2023_50 if speed < edge), "red")


def colour_of_row_2026(row: Row) -> str:
    """Return the colour of a row of suite ncap2026."""
    return colour_2026(row["ego_speed"] / KMH, impact(row) / KMH)


def points_2023(rows: list[Row], agent: str) -> list[Points]:
    """Return an agent's points in suite ncap2023, as lower bounds but for CCRb."""
    cells = _cells(rows, agent, colour_2023)
    found = []
    for scenario, by_speed in POINTS_2023.items():
        earned = 0.0
        for speed, points in by_speed.items():
            places = {place: cells.get((scenario, speed, place), 0.0) for place in OVERLAP_WEIGHTS}
            share = sum(OVERLAP_WEIGHTS[place] * value for place, value in places.items())
            earned += points * share / sum(OVERLAP_WEIGHTS.values())
        shut = scenario.startswith("CCRs") and _gate_shut(rows, agent)
        note = f"contact at {GATE:g} km/h or below: no points" if shut else ""
        found.append(Points(scenario, 0.0 if shut else earned, sum(by_speed.values()), shut, note))
    braking = [row for row in _played(rows, agent) if BRAKING_LEAD.search(row["case"])]
    cases = {row["case"] for row in braking}
    weights = [
        sum(WEIGHTS[colour_2023(row)] for row in braking if row["case"] == case)
        / sum(row["case"] == case for row in braking)
        for case in cases
    ]
    return [*found, Points("CCRb", sum(weights), 4, True)]


def points_2026(rows: list[Row], agent: str) -> list[Points]:
    """Return an agent's points in the standard range of suite ncap2026."""
    cells = _cells(rows, agent, colour_of_row_2026)
    shut = _gate_shut(rows, agent)
    found = []
    for scenario, total in TOTALS_2026.items():
        weights = [value for key, value in cells.items() if key[0].split(",")[0] == scenario]
        earned = total * sum(weights) / len(weights) if weights and not shut else 0.0
        note = f"contact in CCRs at {GATE:g} km/h or below: no points" if shut else ""
        found.append(Points(scenario, earned, total, True, note))
    return found


def _played(rows: list[Row], agent: str) -> list[Row]:
    return [row for row in rows if row["agent"] == agent and row["error"] is None]


def _cells(rows: list[Row], agent: str, colour: Callable[[Row], str]) -> dict[tuple[str, int, int], float]:
    """Return (scenario, speed in km/h, place in per cent) -> weight, the mean over seeds."""
    found: dict[tuple[str, int, int], list[float]] = {}
    for row in _played(rows, agent):
        cell = CELL.search(row["case"])
        if cell:
            scenario = cell["family"] + (", warned driver" if cell["warned"] else "")
            key = scenario, int(cell["speed"]), int(cell["place"])
            found.setdefault(key, []).append(WEIGHTS.get(colour(row), 0.0))
    return {key: sum(weights) / len(weights) for key, weights in found.items()}


def _gate_shut(rows: list[Row], agent: str) -> bool:
    """Return whether CCRs had contact in any run at 20 km/h or below."""
    return any(
        row["collision"] and row["ego_speed"] / KMH < GATE + 0.5
        for row in _played(rows, agent)
        if (cell := CELL.search(row["case"])) and cell["family"] == "CCRs"
    )
