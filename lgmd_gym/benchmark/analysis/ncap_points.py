"""Colours and points of the Euro NCAP suites; derived from the protocols, not an official rating.

2023 (Assessment Protocol Collision Avoidance v10.4.1, 3.3.2): the colour bands are published as numbers for
50 km/h only. A contact at another speed earns nothing, so the points are a lower bound. CCCscp is left out.
2026 (Frontal Collisions v1.1, 5.3): the standard range of the car-to-car rear scenarios. The points of the
other scenarios, of the extended range and of the robustness layer are left out.
A run in which the brakes are applied before the test begins (T0, 4 s before contact) earns nothing in either.
"""

import re
from collections.abc import Callable
from typing import NamedTuple

from lgmd_gym.benchmark.analysis.protocol_limits import COLOUR_WEIGHTS, colour_2026, relative_impact
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.envs.dynamics.units import KMH

REAR_CASE = re.compile(
    r"/(?P<family>CCR[smb])/v(?P<speed>\d+)(?P<warned>-warned)?/(?P<axis>overlap|location)(?P<place>-?\d+)$"
)
BRAKING_LEAD_CASE = re.compile(r"/CCRb/v50/brake\d+-gap\d+$")
BANDS_2023_50 = (("green", 5.0), ("yellow", 15.0), ("orange", 30.0), ("brown", 40.0))  # upper edges [km/h]
OVERLAP_WEIGHTS = {-50: 1, -75: 1, 100: 2, 75: 1, 50: 1}  # from the left side to the right [%]
MAXIMA_2023 = {
    "CCRs": {10: 1, 15: 2, 20: 2, 25: 2, 30: 2, 35: 2, 40: 1, 45: 1, 50: 1},
    "CCRs, warned driver": dict.fromkeys(range(55, 85, 5), 1),
    "CCRm": {speed: 1 if speed <= 60 else 2 for speed in range(30, 85, 5)},
}
MAXIMUM_2023_CCRB = 4.0
MAXIMA_2026 = {"CCRs": 1.2, "CCRm": 2.4, "CCRb": 1.6}  # standard range
GATE = 20.0  # CCRs earns nothing after a contact at this speed or below [km/h]
UNKNOWN_COLOUR = "contact"  # contact whose colour is not published
PREMATURE = "premature"  # in place of a colour: the brakes were applied before the test began


class ScenarioPoints(NamedTuple):
    """Points of one scenario, mean over seeds."""

    scenario: str
    earned: float
    maximum: float
    exact: bool  # False for a lower bound
    note: str = ""  # reason for no points


def row_colour_2023(row: Row) -> str:
    """Return the colour of a row of suite ncap2023, `UNKNOWN_COLOUR` or `PREMATURE`.

    The colour depends on the impact speed in CCRs and CCRb, and on the relative impact speed in CCRm.
    """
    if row["premature_brake"]:
        return PREMATURE
    if not row["collision"]:
        return "green"
    family = row["case"].split("/")[1]
    if round(row["ego_speed"] / KMH) != 50 or family not in ("CCRs", "CCRb"):
        return UNKNOWN_COLOUR
    speed = row["impact_speed"] / KMH
    return next((colour for colour, edge in BANDS_2023_50 if speed < edge), "red")


def row_colour_2026(row: Row) -> str:
    """Return the colour of a row of a suite ncap2026, `UNKNOWN_COLOUR` or `PREMATURE`.

    The colours of contacts are public for CCRs, CCRm and CCRb.
    """
    if row["premature_brake"]:
        return PREMATURE
    if row["collision"] and not row["case"].split("/")[1].startswith("CCR"):
        return UNKNOWN_COLOUR
    return colour_2026(row["ego_speed"] / KMH, relative_impact(row) / KMH)


def colour_weight(colour: str) -> float:
    """Return the share of points that a colour earns; 0 for `UNKNOWN_COLOUR` and `PREMATURE`."""
    return COLOUR_WEIGHTS.get(colour, 0.0)


def points_2023(rows: list[Row], agent: str) -> list[ScenarioPoints]:
    """Return the points of an agent in suite ncap2023; lower bounds except for CCRb."""
    cells = _mean_weights(rows, agent, row_colour_2023)
    points = []
    for scenario, maxima in MAXIMA_2023.items():
        earned = 0.0
        for speed, maximum in maxima.items():
            share = sum(
                weight * cells.get((scenario, speed, place), 0.0) for place, weight in OVERLAP_WEIGHTS.items()
            )
            earned += maximum * share / sum(OVERLAP_WEIGHTS.values())
        gated = scenario.startswith("CCRs") and _is_gated(rows, agent)
        note = f"contact at {GATE:g} km/h or below: no points" if gated else ""
        points.append(ScenarioPoints(scenario, 0.0 if gated else earned, sum(maxima.values()), gated, note))
    return [*points, ScenarioPoints("CCRb", _points_2023_ccrb(rows, agent), MAXIMUM_2023_CCRB, True)]


def _points_2023_ccrb(rows: list[Row], agent: str) -> float:
    """Return the points of CCRb: the sum over its cases of the mean weight over seeds."""
    weights: dict[str, list[float]] = {}
    for row in _completed(rows, agent):
        if BRAKING_LEAD_CASE.search(row["case"]):
            weights.setdefault(row["case"], []).append(colour_weight(row_colour_2023(row)))
    return sum(sum(of_case) / len(of_case) for of_case in weights.values())


def points_2026(rows: list[Row], agent: str) -> list[ScenarioPoints]:
    """Return the points of an agent in the standard range of suite ncap2026."""
    cells = _mean_weights(rows, agent, row_colour_2026)
    gated = _is_gated(rows, agent)
    note = f"contact in CCRs at {GATE:g} km/h or below: no points" if gated else ""
    points = []
    for scenario, maximum in MAXIMA_2026.items():
        weights = [weight for key, weight in cells.items() if key[0].split(",")[0] == scenario]
        earned = maximum * sum(weights) / len(weights) if weights and not gated else 0.0
        points.append(ScenarioPoints(scenario, earned, maximum, True, note))
    return points


ROW_COLOURS: dict[str, Callable[[Row], str]] = {
    "ncap2023": row_colour_2023,
    "ncap2023-vru": row_colour_2023,
    "ncap2026": row_colour_2026,
    "ncap2026-extended": row_colour_2026,
}
SUITE_POINTS: dict[str, Callable[[list[Row], str], list[ScenarioPoints]]] = {
    "ncap2023": points_2023,
    "ncap2026": points_2026,
}


def _completed(rows: list[Row], agent: str) -> list[Row]:
    return [row for row in rows if row["agent"] == agent and row["error"] is None]


def _mean_weights(
    rows: list[Row], agent: str, colour: Callable[[Row], str]
) -> dict[tuple[str, int, int], float]:
    """Return the mean weight over seeds by (scenario, speed [km/h], overlap or impact location [%])."""
    weights: dict[tuple[str, int, int], list[float]] = {}
    for row in _completed(rows, agent):
        if case := REAR_CASE.search(row["case"]):
            scenario = case["family"] + (", warned driver" if case["warned"] else "")
            key = scenario, int(case["speed"]), int(case["place"])
            weights.setdefault(key, []).append(colour_weight(colour(row)))
    return {key: sum(of_cell) / len(of_cell) for key, of_cell in weights.items()}


def _is_gated(rows: list[Row], agent: str) -> bool:
    """Return whether any CCRs run at 20 km/h or below ended in contact."""
    return any(
        row["collision"] and row["ego_speed"] / KMH < GATE + 0.5
        for row in _completed(rows, agent)
        if (case := REAR_CASE.search(row["case"])) and case["family"] == "CCRs"
    )
