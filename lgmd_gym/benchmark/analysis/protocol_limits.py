"""Limits of UN R152, FMVSS 127 and Euro NCAP 2026, applied to rows; not an official rating."""

from collections.abc import Callable
from typing import NamedTuple

from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import case_order, cases_and_worlds
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.statistics.intervals import Rate

# UN R152 Rev.2, 5.2.1.4, 5.2.2 and 5.2.3, M1, by target: relative speeds, and the highest relative impact
# speeds at maximum mass and in running order, all in km/h. Between two columns the limit of the higher speed
# holds.
R152_LIMITS = {
    "car": ((40, 42, 45, 50, 55, 60), (0, 10, 15, 25, 30, 35), (0, 0, 15, 25, 30, 35)),
    "pedestrian": ((40, 42, 45, 50, 55, 60), (0, 10, 15, 25, 30, 35), (0, 0, 15, 25, 30, 35)),
    "bicycle": ((38, 40, 45, 50, 55, 60), (0, 10, 25, 30, 35, 40), (0, 0, 25, 30, 35, 40)),
}
R152_FAILURES = {"car": 0.10, "pedestrian": 0.10, "bicycle": 0.20}  # highest share of failed runs (6.10.1)
R152_TARGETS = {"CPNA": "pedestrian", "CBNA": "bicycle"}  # by family; a car in the others
R152_LADEN = ("CCRs/v40", "CPNA/v40", "CBNA/v38")  # cases at maximum mass
R152_SUITES = ("r152", "r152-vru")

# Euro NCAP Frontal Collisions 2026, 5.3.1: ego speed -> upper edges of the colours, relative impact speed,
# both in km/h. An edge belongs to the worse colour.
BANDS_2026 = {
    20: (("green", 0.0),),
    30: (("green", 0.0), ("brown", 10.0)),
    40: (("green", 0.0), ("orange", 10.0), ("brown", 20.0)),
    50: (("green", 0.0), ("yellow", 10.0), ("orange", 20.0), ("brown", 30.0)),
}
COLOUR_WEIGHTS = {"green": 1.0, "yellow": 0.75, "orange": 0.5, "brown": 0.25, "red": 0.0}


# Compares a row with its limit; returns whether the row meets it, and the limit in words.
LimitCheck = Callable[[Row], tuple[bool, str]]


class LimitResult(NamedTuple):
    """Number of runs of one agent in one case that meet the limit."""

    agent: str
    case: str
    limit: str
    met: Rate
    worst: float  # highest relative impact speed [m/s]


def relative_impact(row: Row) -> float:
    """Return the relative impact speed of a row [m/s]; 0 without contact."""
    return row["relative_impact_speed"] or 0.0


def r152_limit(relative_kmh: float, load: str, target: str = "car") -> float:
    """Return the highest relative impact speed that UN R152 allows an M1 car [km/h].

    Args:
        relative_kmh: Relative speed at the start, in [0, 60] [km/h].
        load: "laden" (maximum mass) or "unladen" (running order).
        target: "car", "pedestrian" or "bicycle".

    Raises:
        ValueError: Above 60 km/h, where the regulation sets no limit.
    """
    speeds, laden, unladen = R152_LIMITS[target]
    for speed, limit in zip(speeds, laden if load == "laden" else unladen, strict=True):
        if relative_kmh <= speed + 1e-6:
            return float(limit)
    raise ValueError(f"relative_kmh must be at most 60, the highest speed in UN R152, got {relative_kmh:g}")


def r152_load(case: str) -> str:
    """Return the load state whose limit applies to a case of suite r152 or r152-vru.

    The regulation tests 40 km/h (bicycle: 38 km/h) laden only and the other speeds in both states; unladen is
    the stricter one.
    """
    return "laden" if case.endswith(R152_LADEN) else "unladen"


def r152_target(case: str) -> str:
    """Return the kind of target of a case of suite r152 or r152-vru."""
    return R152_TARGETS.get(case.split("/")[1], "car")


def colour_2026(ego_kmh: float, impact_kmh: float) -> str:
    """Return the Euro NCAP 2026 colour of a relative impact speed.

    Args:
        ego_kmh: Ego speed of the test [km/h].
        impact_kmh: Relative impact speed [km/h]; 0 without contact.

    Example:
        >>> [colour_2026(50, speed) for speed in (0, 9.9, 10, 35)]
        ['green', 'yellow', 'orange', 'red']
    """
    if impact_kmh <= 0.0:
        return "green"
    bands = BANDS_2026[min(max(10 * int(ego_kmh / 10 + 1e-6), 20), 50)]
    return next((colour for colour, edge in bands if impact_kmh < edge), "red")


def check_r152(row: Row) -> tuple[bool, str]:
    """Compare a row of suite r152 or r152-vru with the impact speed limit of its relative speed and load.

    The relative speed to a crossing pedestrian or bicycle is that of the ego. Premature braking fails,
    because it begins before the start of the test (T0).
    """
    load, target = r152_load(row["case"]), r152_target(row["case"])
    along = row["target_speed"] if target == "car" else 0.0
    limit = r152_limit(round((row["ego_speed"] - along) / KMH, 3), load, target)
    met = relative_impact(row) / KMH <= limit + 1e-9 and not row["premature_brake"]
    return met, f"≤ {limit:g} km/h {load}"


def check_fmvss127(row: Row) -> tuple[bool, str]:
    """Check a row of suite fmvss127 or fmvss127-pedestrian for contact and for premature braking.

    49 CFR 571.127 S5.1.3 and S5.2.3 require that the brakes are applied when a collision is imminent, and
    that no contact follows. Until then the test speed is maintained: from a time to collision of 5.0 s on
    (S7.2, S7.3.2, S7.4.2) or 4.0 s (S8.2), or from 3 s before the lead vehicle brakes (S7.5.2). The standard
    sets no time for "imminent"; as in `check_r152`, braking more than 4 s before the contact of `no-brake`
    fails.
    """
    return not row["collision"] and not row["premature_brake"], "no contact"


def check_green(row: Row) -> tuple[bool, str]:
    """Check a row of a suite ncap2026 for green, no contact; premature braking fails, as in `check_r152`."""
    return not row["collision"] and not row["premature_brake"], "green"


LIMIT_CHECKS = {
    **dict.fromkeys(R152_SUITES, check_r152),
    **dict.fromkeys(("fmvss127", "fmvss127-pedestrian"), check_fmvss127),
    **dict.fromkeys(("ncap2026", "ncap2026-extended", "ncap2026-robustness"), check_green),
}


def limit_results(rows: list[Row], agent: str, check: LimitCheck) -> list[LimitResult]:
    """Return the result of an agent per case, over its threats without an error."""
    threats = [row for row in rows if row["agent"] == agent and row["error"] is None and row["threat"]]
    results = []
    for case in sorted({row["case"] for row in threats}, key=case_order):
        of_case = [row for row in threats if row["case"] == case]
        met, limits = zip(*map(check, of_case), strict=True)
        limit, worst = " / ".join(sorted(set(limits))), max(map(relative_impact, of_case))
        rate = Rate.clustered(met, *cases_and_worlds(of_case))
        results.append(LimitResult(agent, case, limit, rate, worst))
    return results


def meets_r152(rows: list[Row], agent: str) -> bool:
    """Return whether an agent meets the impact speed limits of UN R152 in simulation.

    As in 6.10.1, at most 10 % of all runs with cars and with pedestrians, and 20 % with bicycles, may fail.
    """
    results = limit_results(rows, agent, check_r152)
    for target, share in R152_FAILURES.items():
        met = [item.met for item in results if r152_target(item.case) == target]
        if sum(rate.n - rate.k for rate in met) > share * sum(rate.n for rate in met):
            return False
    return bool(results)
