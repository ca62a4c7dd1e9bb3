"""Euro NCAP's Crash Avoidance - Frontal Collisions v1.1 (October 2025, implementation 2026), here called N3.

An impact location of p per cent places the target's centre, a pedestrian's hip or a bicycle's crankshaft
(p - 50) per cent of the ego's width from the ego's centreline, + left, as in the OpenSCENARIO files of the
protocol. The grids are those of these files.

Colours and points (5.3) are derived from the protocol; they are no official rating. They cover the standard
range of the car-to-car rear scenarios, without the extended range and the robustness layer.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import product
from math import radians

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.benchmark.case import Case, Points, Row, Suite, make_case, relative_impact, speed_cases, to_mps
from lgmd_gym.benchmark.protocols.car_to_car_2023 import (
    GATE,
    PREMATURE,
    UNKNOWN_COLOUR,
    completed,
    is_gated,
    mean_weights,
    turns,
)
from lgmd_gym.envs.dynamics.units import KMH

LOCATIONS = (100, 75, 50, 25, 0)  # per cent of the ego's width; the extended range adds 125 and -25
LIGHTS = ("day", "night")
SIDES = ("left", "right")
# Ego and target speeds of CCRm in km/h: a target at 20 up to 80, above it 60 slower than the ego.
CCRM_SPEEDS = tuple((speed, max(20, speed - 60)) for speed in range(30, 140, 10))
HEAD_ON_SPEEDS = ((30, 50), (40, 50), (50, 50), (60, 70), (70, 70), (80, 70))
FAST_HEAD_ON = ((90, 90), (100, 100))
SCP_SPEEDS = tuple(product(range(20, 70, 10), range(20, 70, 10)))
FAST_SCP = tuple(
    (a, b) for slow, fast in product((20, 30), (70, 80)) for a, b in ((slow, fast), (fast, slow))
)
FAST_TAP = (*((speed, 80) for speed in (10, 15, 20, 25)), (25, 30), (25, 45), (25, 60))
BRAKING: Values = {"headway": 1.0, "deceleration": 4.0}  # of CCRb and CMRb
CROSSING = range(10, 70, 10)
# Euro NCAP Frontal Collisions 2026, 5.3.1: ego speed -> upper edges of the colours, relative impact speed,
# both in km/h. An edge belongs to the worse colour.
BANDS_2026 = {
    20: (("green", 0.0),),
    30: (("green", 0.0), ("brown", 10.0)),
    40: (("green", 0.0), ("orange", 10.0), ("brown", 20.0)),
    50: (("green", 0.0), ("yellow", 10.0), ("orange", 20.0), ("brown", 30.0)),
}
MAXIMA_2026 = {"CCRs": 1.2, "CCRm": 2.4, "CCRb": 1.6}  # points of the standard range


def ncap2026() -> tuple[Case, ...]:
    """Return the standard range, 428 cells."""
    suite = "ncap2026"
    return (
        *_cells(suite, "CCRs", range(10, 60, 10), LOCATIONS),
        *_cells(suite, "CCRs", range(60, 90, 10), LOCATIONS, warned=True),
        *_moving(suite, "CCRm", CCRM_SPEEDS, LOCATIONS),
        *_cells(suite, "CCRb", range(30, 90, 10), LOCATIONS, **BRAKING),
        *_pairs(suite, "CCCscp", SCP_SPEEDS, SIDES, obstructed=True),
        *turns(suite, "CCFtap"),
        *_moving(suite, "CCFhos", HEAD_ON_SPEEDS, (25, 50, 75)),
        *_cells(suite, "CMRs", range(10, 60, 10), (75, 50, 25)),
        *_cells(suite, "CMRs", range(60, 90, 10), (75, 50, 25), warned=True),
        *_cells(suite, "CMRb", range(30, 90, 10), (75, 50, 25), **BRAKING),
        *_pairs(suite, "CMCscp", SCP_SPEEDS, SIDES, obstructed=True),
        *turns(suite, "CMFtap"),
        *_cells(suite, "CPNA", CROSSING, (25, 50, 75), LIGHTS),
        *_cells(suite, "CPFA", CROSSING, (50,), LIGHTS),
        *_cells(suite, "CPNCO", CROSSING, (50,), LIGHTS),
        *_cells(suite, "CPLA", CROSSING, (50,), LIGHTS),
        *_cells(suite, "CPLA", range(50, 90, 10), (25,), LIGHTS, warned=True),
        *_cells(suite, "CBNA", CROSSING, (50, 75)),
        *_cells(suite, "CBNAO", CROSSING, (50, 75)),
        *_cells(suite, "CBFA", CROSSING, (25, 50)),
        *_cells(suite, "CBLA", range(20, 70, 10), (50,), bicycle_speed=to_mps(15)),
        *_cells(suite, "CBLA", range(50, 90, 10), (25,), warned=True, bicycle_speed=to_mps(20)),
    )


def ncap2026_extended() -> tuple[Case, ...]:
    """Return the extended range, 435 cells."""
    suite, outside, edges = "ncap2026-extended", (125, -25), (90, 10)
    return (
        *_cells(suite, "CCRs", range(10, 60, 10), outside),
        *_cells(suite, "CCRs", range(60, 90, 10), outside, warned=True),
        *_moving(suite, "CCRm", CCRM_SPEEDS, outside),
        *_cells(suite, "CCRb", range(30, 90, 10), outside, **BRAKING),
        *_cells(suite, "CCRb", range(90, 140, 10), (*LOCATIONS, *outside), **BRAKING),
        *_pairs(suite, "CCCscp", FAST_SCP, SIDES),
        *_pairs(suite, "CCFtap", FAST_TAP),
        *_moving(suite, "CCFhos", HEAD_ON_SPEEDS, (100,)),
        *_moving(suite, "CCFhos", FAST_HEAD_ON, (100, 75, 50, 25)),
        *_cells(suite, "CMRs", range(10, 60, 10), edges),
        *_cells(suite, "CMRs", range(60, 90, 10), edges, warned=True),
        *_cells(suite, "CMRb", range(30, 90, 10), edges, **BRAKING),
        *_cells(suite, "CMRb", range(90, 140, 10), (90, 75, 50, 25, 10), **BRAKING),
        *_pairs(suite, "CMCscp", FAST_SCP, SIDES),
        *_pairs(suite, "CMFtap", FAST_TAP),
        *_cells(suite, "CPNA", CROSSING, edges, LIGHTS),
        *_cells(suite, "CPFA", CROSSING, (90, 75, 25, 10), LIGHTS),
        *_cells(suite, "CPNCO", CROSSING, (75, 25), LIGHTS),
        *_cells(suite, "CPLA", CROSSING, (75, 25, 10), LIGHTS),
        *_cells(suite, "CPLA", range(50, 90, 10), (75, 50, 10), LIGHTS, warned=True),
        *_cells(suite, "CBNA", CROSSING, (90, 25, 10)),
        *_cells(suite, "CBNAO", CROSSING, (90, 25, 10)),
        *_cells(suite, "CBFA", CROSSING, (90, 75, 10)),
        *_cells(suite, "CBLA", range(20, 70, 10), (75, 25, 10), bicycle_speed=to_mps(15)),
        *_cells(suite, "CBLA", range(50, 90, 10), (75, 50, 10), warned=True, bicycle_speed=to_mps(20)),
    )


def ncap2026_robustness() -> tuple[Case, ...]:
    """Return the public part of the robustness layer (N3 5.2.1.3) at two speeds of each scenario, aligned.

    Target heading ±10° and ±20°; a car next to the target; night and glare (the weather `low_sun`) for
    CCRs, CCRm and CCRb; ±2 m/s² of deceleration and ±0.5 s of headway for CCRb; ±5 km/h of the target for
    CCCscp, CCFtap and CCFhos. The path of CCFtap (±0.5 m) and the timing of CCCscp (±0.1 s) are not varied.
    """
    suite, rows = "ncap2026-robustness", list[Case]()
    for degrees_left in (-20, -10, 10, 20):
        heading = round(radians(degrees_left), 6)
        rows += speed_cases(suite, "CCRs", [30, 50], f"/heading{degrees_left}", target_heading=heading)
    for family, more in (("CCRs", {}), ("CCRm", {}), ("CCRb", BRAKING)):
        for variant, change in (
            ("beside", {"beside": True}),
            ("night", {"weather": "night"}),
            ("glare", {"weather": "low_sun"}),
        ):
            rows += speed_cases(suite, family, [30, 50], f"/{variant}", **change, **more)
    for variant, change in (
        ("decel2", {"deceleration": 2.0}),
        ("decel6", {"deceleration": 6.0}),
        ("headway0.5", {"headway": 0.5}),
        ("headway1.5", {"headway": 1.5}),
    ):
        rows += speed_cases(suite, "CCRb", [50], f"/{variant}", **(BRAKING | change))
    for family, ego, target in (("CCCscp", 40, 40), ("CCFtap", 15, 45), ("CCFhos", 50, 50)):
        cars: Arguments = {"obstructed": True} if family == "CCCscp" else {}
        rows += _pairs(suite, family, ((ego, target - 5), (ego, target + 5)), **cars)
    return tuple(rows)


def _cells(
    suite: str,
    family: str,
    speeds: Iterable[int],
    locations: Iterable[int],
    lights: Iterable[str] = ("day",),
    warned: bool = False,
    **arguments: object,
) -> list[Case]:
    """Return the cells of all ego speeds, impact locations and lights."""
    rows: list[Case] = []
    for per_cent, light in product(locations, lights):
        tail = f"{'-warned' if warned else ''}/location{per_cent}{'-night' if light == 'night' else ''}"
        more: Arguments = {"weather": "night"} if light == "night" else {}
        cells = speed_cases(
            suite, family, list(speeds), tail, impact_location=per_cent / 100, **arguments, **more
        )
        rows += [replace(cell, fcw_driver=warned) for cell in cells]
    return rows


def _moving(
    suite: str, family: str, speeds: Iterable[tuple[int, int]], locations: Iterable[int]
) -> list[Case]:
    """Return the cells of all pairs of ego and target speed and impact locations."""
    return [
        case
        for per_cent, (ego, target) in product(locations, speeds)
        for case in _cells(suite, family, [ego], [per_cent], target_speed=to_mps(target))
    ]


def _pairs(
    suite: str,
    family: str,
    speeds: Iterable[tuple[int, int]],
    sides: Iterable[str] = (),
    **arguments: object,
) -> list[Case]:
    """Return a cell for every pair of ego and target speed, and every side."""
    rows: list[Case] = []
    for (ego, target), side in product(speeds, tuple(sides) or ("",)):
        variant, where = f"v{ego}/target{target}", {"side": side} if side else {}
        pair = {"ego_speed": to_mps(ego), "target_speed": to_mps(target)}
        rows.append(
            make_case(suite, family, f"{variant}-{side}" if side else variant, **pair, **where, **arguments)
        )
    return rows


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


def check_green(row: Row) -> tuple[bool, str]:
    """Check a row of a suite ncap2026 for green, no contact; premature braking fails, as in `check_r152`."""
    return not row["collision"] and not row["premature_brake"], "green"


def row_colour_2026(row: Row) -> str:
    """Return the colour of a row of a suite ncap2026, `UNKNOWN_COLOUR` or `PREMATURE`.

    The colours of contacts are public for CCRs, CCRm and CCRb.
    """
    if row["premature_brake"]:
        return PREMATURE
    if row["collision"] and row["family"] not in MAXIMA_2026:
        return UNKNOWN_COLOUR
    return colour_2026(row["ego_speed"] / KMH, relative_impact(row) / KMH)


def points_2026(rows: list[Row], agent: str) -> list[Points]:
    """Return the points of an agent in the standard range of suite ncap2026."""
    rows = completed(rows, agent)
    cells, gated = mean_weights(rows, row_colour_2026), is_gated(rows)
    note = f"contact in CCRs at {GATE:g} km/h or below: no points" if gated else ""
    points = list[Points]()
    for scenario, maximum in MAXIMA_2026.items():
        weights = [weight for (family, *_), weight in cells.items() if family == scenario]
        earned = maximum * sum(weights) / len(weights) if weights and not gated else 0.0
        points.append(Points(scenario, earned, maximum, True, note))
    return points


SUITES = (
    Suite(
        name="ncap2026",
        cases=ncap2026(),
        about="Euro NCAP Frontal Collisions 2026: standard range",
        limit=check_green,
        colour=row_colour_2026,
        points=points_2026,
    ),
    Suite(
        name="ncap2026-extended",
        cases=ncap2026_extended(),
        about="Euro NCAP Frontal Collisions 2026: extended range",
        limit=check_green,
        colour=row_colour_2026,
    ),
    Suite(
        name="ncap2026-robustness",
        cases=ncap2026_robustness(),
        about="Euro NCAP Frontal Collisions 2026: public part of the robustness layer",
        limit=check_green,
    ),
)
