"""Euro NCAP's test protocol AEB Car-to-Car v4.3.1 (February 2024, implementation 2023), here called N1.

Colours and points (Assessment Protocol Collision Avoidance v10.4.1, 3.3.2) are derived from the protocol.
They are not an official rating. The colour bands are published as numbers for 50 km/h only. A contact at
another speed earns nothing, so the points are a lower bound. CCCscp is left out. A run in which the
brakes are applied before the test begins (T0, 4 s before contact) earns nothing.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

from lgmd_gym.benchmark.case import Case, Points, Row, Suite, make_case, scenario_case, speed_cases, to_mps
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.scenario import without_target

OVERLAPS = (-50, -75, 100, 75, 50)  # N1 8.2.2: per cent of the ego's width; the sign is the side
TAP_SPEEDS = ((10, 15, 20), (30, 45, 60))  # N1 8.2: ego and target speeds of CCFtap [km/h]
BANDS_2023_50 = (("green", 5.0), ("yellow", 15.0), ("orange", 30.0), ("brown", 40.0))  # upper edges [km/h]
REAR = ("CCRs", "CCRm", "CCRb")
OVERLAP_WEIGHTS = {-50: 1, -75: 1, 100: 2, 75: 1, 50: 1}  # from the left side to the right [%]
WARNED = ", warned driver"
MAXIMA_2023 = {
    "CCRs": {10: 1, 15: 2, 20: 2, 25: 2, 30: 2, 35: 2, 40: 1, 45: 1, 50: 1},
    f"CCRs{WARNED}": dict.fromkeys(range(55, 85, 5), 1),
    "CCRm": {speed: 1 if speed <= 60 else 2 for speed in range(30, 85, 5)},
}
MAXIMUM_2023_CCRB = 4.0
GATE = 20.0  # CCRs earns nothing after a contact at this speed or below [km/h]
UNKNOWN_COLOUR = "contact"  # contact whose colour is not published
PREMATURE = "premature"  # in place of a colour: the brakes were applied before the test began
COLOUR_WEIGHTS = {"green": 1.0, "yellow": 0.75, "orange": 0.5, "brown": 0.25, "red": 0.0}
SUFFIX = "-without-target"
"""Ending of the names of suites of threats without their target, after the name of the suite with targets."""


def ncap2023() -> tuple[Case, ...]:
    """Return the cases of N1 8.2.

    CCRs 45 AEB and 30 FCW, CCRm 55, CCRb 4, CCCscp 30, CCFtap 9, CCFhos 2, CCFhol 2.
    """
    suite = "ncap2023"
    aeb = list(range(10, 55, 5))
    fcw = list(range(55, 85, 5))
    moving = list(range(30, 85, 5))
    rows: list[Case] = []
    for family, speeds in (("CCRs", aeb), ("CCRm", moving)):
        for per_cent in OVERLAPS:
            rows += speed_cases(suite, family, speeds, f"/overlap{per_cent}", overlap=per_cent / 100)
    for per_cent in OVERLAPS:
        tail = f"-warned/overlap{per_cent}"
        cells = speed_cases(suite, "CCRs", fcw, tail, overlap=per_cent / 100)
        rows += [replace(cell, fcw_driver=True) for cell in cells]
    return (*rows, *braking_lead(suite), *_crossing(suite), *turns(suite, "CCFtap"), *_head_on(suite))


def braking_lead(suite: str) -> tuple[Case, ...]:
    """Return the CCRb cases of N1 8.2.2.3: both cars at 50 km/h, 2 and 6 m/s², gaps of 12 and 40 m."""
    return tuple(
        make_case(
            suite,
            "CCRb",
            f"v50/brake{strength}-gap{gap}",
            ego_speed=to_mps(50),
            gap=float(gap),
            deceleration=float(strength),
            build_up=1.0,
        )
        for strength in (2, 6)
        for gap in (12, 40)
    )


def _crossing(suite: str) -> tuple[Case, ...]:
    """Return the CCCscp cases of N1 8.2.5: from a stop 2.9 m before the path, and at 20 to 60 km/h.

    The target drives at 20 to 60 km/h and comes from the far side, the left, which is the default of the
    OpenSCENARIO file for 2026.
    """
    starts: list[tuple[str, int, dict[str, bool]]] = [("from-stop", 20, {"from_stop": True})]
    starts += [(f"v{speed}", speed, {}) for speed in range(20, 70, 10)]
    rows: list[Case] = []
    for start, speed, more in starts:
        for target in range(20, 70, 10):
            speeds = {"ego_speed": to_mps(speed), "target_speed": to_mps(target)}
            rows.append(make_case(suite, "CCCscp", f"{start}/target{target}", **speeds, side="left", **more))
    return tuple(rows)


def turns(suite: str, family: str) -> tuple[Case, ...]:
    """Return the cases of N1 8.2 for a target whose path the ego turns across."""
    return tuple(
        make_case(
            suite, family, f"v{speed}/target{target}", ego_speed=to_mps(speed), target_speed=to_mps(target)
        )
        for speed in TAP_SPEEDS[0]
        for target in TAP_SPEEDS[1]
    )


def _head_on(suite: str) -> tuple[Case, ...]:
    """Return the cases of CCFhos and CCFhol at 50 and 70 km/h.

    The lane change of CCFhol is 44 and 60 m long, 13.9 and 19.4 m behind the overtaken car.
    """
    cells: tuple[tuple[str, int, dict[str, float]], ...] = (
        ("CCFhos", 50, {}),
        ("CCFhos", 70, {}),
        ("CCFhol", 50, {"change_length": 44.0, "following_distance": 13.9}),
        ("CCFhol", 70, {"change_length": 60.0, "following_distance": 19.4}),
    )
    return tuple(
        make_case(suite, family, f"v{speed}", ego_speed=to_mps(speed), target_speed=to_mps(speed), **change)
        for family, speed, change in cells
    )


def without_targets(suite: Suite) -> Suite:
    """Return a suite without the targets, in the same order and with the same variants.

    With the order, the cases also have the worlds of those with targets, see `RunConfig.world`. The grey
    levels of the other actors may differ, because they are drawn in the order of the actors. An agent that
    brakes there does not brake for the target.
    """
    name = suite.name + SUFFIX
    cases = (
        scenario_case(name, case.variant, without_target(case.scenario), case.fcw_driver, **case.appearance)
        for case in suite.cases
    )
    about = (
        f"the cases of {suite.name} without their targets, in the same worlds; braking is a false activation"
    )
    return Suite(name=name, cases=tuple(cases), about=about)


def row_colour_2023(row: Row) -> str:
    """Return the colour of a row of suite ncap2023, `UNKNOWN_COLOUR` or `PREMATURE`.

    The colour depends on the impact speed in CCRs and CCRb, and on the relative impact speed in CCRm.
    """
    if row["premature_brake"]:
        return PREMATURE
    if not row["collision"]:
        return "green"
    if round(row["ego_speed"] / KMH) != 50 or row["family"] not in ("CCRs", "CCRb"):
        return UNKNOWN_COLOUR
    speed = (row["impact_speed"] or 0.0) / KMH
    return next((colour for colour, edge in BANDS_2023_50 if speed < edge), "red")


def colour_weight(colour: str) -> float:
    """Return the share of points that a colour earns; 0 for `UNKNOWN_COLOUR` and `PREMATURE`."""
    return COLOUR_WEIGHTS.get(colour, 0.0)


def points_2023(rows: list[Row], agent: str) -> list[Points]:
    """Return the points of an agent in suite ncap2023; lower bounds except for CCRb."""
    rows = completed(rows, agent)
    cells = mean_weights(rows, row_colour_2023)
    points = list[Points]()
    for scenario, maxima in MAXIMA_2023.items():
        family, warned = scenario.removesuffix(WARNED), scenario.endswith(WARNED)
        earned = 0.0
        for speed, maximum in maxima.items():
            share = sum(
                weight * cells.get((family, warned, speed, place), 0.0)
                for place, weight in OVERLAP_WEIGHTS.items()
            )
            earned += maximum * share / sum(OVERLAP_WEIGHTS.values())
        gated = family == "CCRs" and is_gated(rows)
        note = f"contact at {GATE:g} km/h or below: no points" if gated else ""
        points.append(Points(scenario, 0.0 if gated else earned, sum(maxima.values()), gated, note))
    return [*points, Points("CCRb", _points_2023_ccrb(rows), MAXIMUM_2023_CCRB, True)]


def _points_2023_ccrb(rows: list[Row]) -> float:
    """Return the points of CCRb: the sum over its cases of the mean weight over seeds."""
    weights: dict[str, list[float]] = {}
    for row in rows:
        if row["family"] == "CCRb":
            weights.setdefault(row["case"], []).append(colour_weight(row_colour_2023(row)))
    return sum(sum(of_case) / len(of_case) for of_case in weights.values())


def completed(rows: list[Row], agent: str) -> list[Row]:
    """Return the rows of an agent without an error."""
    return [row for row in rows if row["agent"] == agent and row["error"] is None]


def mean_weights(
    rows: Iterable[Row], colour: Callable[[Row], str]
) -> dict[tuple[str, bool, int, int], float]:
    """Return the mean weight over seeds of the cells of CCRs, CCRm and CCRb.

    The keys are family, whether a driver brakes, speed [km/h], and overlap or impact location [%].
    """
    weights: dict[tuple[str, bool, int, int], list[float]] = {}
    for row in rows:
        place = row["impact_location"] if row["overlap"] is None else row["overlap"]
        if row["family"] in REAR and place is not None and row["test_speed"] is not None:
            speed = round(row["test_speed"] / KMH)
            key = row["family"], row["fcw_driver"], speed, round(100 * place)
            weights.setdefault(key, []).append(colour_weight(colour(row)))
    return {key: sum(of_cell) / len(of_cell) for key, of_cell in weights.items()}


def is_gated(rows: Iterable[Row]) -> bool:
    """Return whether any CCRs run at 20 km/h or below ended in contact."""
    return any(
        row["family"] == "CCRs" and row["collision"] and row["ego_speed"] / KMH < GATE + 0.5 for row in rows
    )


_NCAP2023 = Suite(
    name="ncap2023",
    cases=ncap2023(),
    about="Euro NCAP AEB Car-to-Car 2023: CCRs, CCRm, CCRb, CCCscp, CCFtap, CCFhos, CCFhol",
    colour=row_colour_2023,
    points=points_2023,
)
SUITES = (_NCAP2023, without_targets(_NCAP2023))
