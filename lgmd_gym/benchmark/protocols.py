"""Test grids of the emergency-braking protocols, with the source of every number.

N1 is Euro NCAP's test protocol AEB Car-to-Car v4.3.1 (February 2024, implementation 2023).
"""

from dataclasses import replace
from math import radians
from typing import Any

from lgmd_gym.benchmark.case import Case, make_case, speed_cases, to_mps

OVERLAPS = (-50, -75, 100, 75, 50)  # N1 8.2.2: per cent of the ego's width; the sign is the side
# Ego and target speeds of CCRm in km/h, 2026: a target at 20 up to 80, above it 60 slower than the ego.
CCRM_SPEEDS_2026 = tuple((speed, max(20, speed - 60)) for speed in range(30, 140, 10))
LOCATIONS_2026 = (100, 75, 50, 25, 0)  # per cent of the ego's width; the extended range adds 125 and -25
R152_TARGET = 20  # km/h, UN R152 6.5


def ncap2023() -> tuple[Case, ...]:
    """Return the cases of N1 8.2: CCRs 45 AEB and 30 FCW, CCRm 55, CCRb 4, CCCscp 30."""
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
    return (*rows, *braking_lead(suite), *_crossing(suite))


def ncap2026() -> tuple[Case, ...]:
    """Return the rear scenarios of Euro NCAP Crash Avoidance - Frontal Collisions v1.1, 3.1.

    The standard range is covered: CCRs 25 AEB and 15 FCW, CCRm 55, CCRb 30. An impact location of p per cent
    places the target's centre (p - 50) per cent of the ego's width from the ego's centreline, + left, as in
    the OpenSCENARIO files of the protocol; the official calculator does not define the geometry. CCRb:
    headway 1.0 s, 4 m/s² within 1.0 s. The robustness layer (5.2.1.3) adds, aligned: a rotated target, a car
    next to the target, night, and for CCRb ±2 m/s² of deceleration and ±0.5 s of headway. Its glare condition
    is not implemented.
    """
    suite = "ncap2026"
    rows: list[Case] = []
    for per_cent in LOCATIONS_2026:
        tail, where = f"/location{per_cent}", per_cent / 100
        rows += speed_cases(suite, "CCRs", list(range(10, 60, 10)), tail, impact_location=where)
        for ego, target in CCRM_SPEEDS_2026:
            speeds = {"target_speed": to_mps(target), "impact_location": where}
            rows += speed_cases(suite, "CCRm", [ego], tail, **speeds)
        rows += speed_cases(
            suite, "CCRb", list(range(30, 90, 10)), tail, headway=1.0, deceleration=4.0, impact_location=where
        )
        fcw = speed_cases(suite, "CCRs", list(range(60, 90, 10)), f"-warned{tail}", impact_location=where)
        rows += [replace(cell, fcw_driver=True) for cell in fcw]
    return (*rows, *_robustness(suite))


def _robustness(suite: str) -> tuple[Case, ...]:
    """Return the robustness layer of ncap2026, aligned."""
    rows: list[Case] = []
    for degrees_left in (-20, -10, 10, 20):
        heading = round(radians(degrees_left), 6)
        rows += speed_cases(
            suite,
            "CCRs",
            [30, 50],
            f"/robust-heading{degrees_left}",
            impact_location=0.5,
            target_heading=heading,
        )
    lead: dict[str, Any] = {"headway": 1.0, "deceleration": 4.0}
    for family, more in (("CCRs", {}), ("CCRm", {}), ("CCRb", lead)):
        for variant, change in (("beside", {"beside": True}), ("night", {"condition": "night"})):
            arguments = {"impact_location": 0.5, **change, **more}
            rows += speed_cases(suite, family, [30, 50], f"/robust-{variant}", **arguments)
    for variant, change in (
        ("decel2", {"deceleration": 2.0}),
        ("decel6", {"deceleration": 6.0}),
        ("headway0.5", {"headway": 0.5}),
        ("headway1.5", {"headway": 1.5}),
    ):
        rows += speed_cases(suite, "CCRb", [50], f"/robust-{variant}", impact_location=0.5, **(lead | change))
    return tuple(rows)


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
    targets = range(20, 70, 10)
    from_stop = [
        make_case(
            suite,
            "CCCscp",
            f"from-stop/target{target}",
            ego_speed=to_mps(20),
            target_speed=to_mps(target),
            side="left",
            from_stop=True,
        )
        for target in targets
    ]
    moving = [
        make_case(
            suite,
            "CCCscp",
            f"v{speed}/target{target}",
            ego_speed=to_mps(speed),
            target_speed=to_mps(target),
            side="left",
        )
        for speed in range(20, 70, 10)
        for target in targets
    ]
    return (*from_stop, *moving)


def r152() -> tuple[Case, ...]:
    """Return the cases of UN R152 6.4 (stationary target, 20 to 60 km/h) and 6.5 (moving, 30 and 60).

    40 km/h is tested at maximum mass and 42 km/h in running order. The brake model has no mass, so the load
    states differ only in their limits.
    """
    return (
        *speed_cases("r152", "CCRs", [20, 40, 42, 60]),
        *speed_cases("r152", "CCRm", [30, 60], target_speed=to_mps(R152_TARGET)),
    )


def fmvss127() -> tuple[Case, ...]:
    """Return the cases of 49 CFR 571.127 S7.3 to S7.5 without manual braking.

    The deceleration is reached 1.0 s after its onset (S7.5 allows up to 1.5 s).
    """
    suite = "fmvss127"
    decelerating = tuple(
        make_case(
            suite,
            "CCRb",
            f"v{speed}/brake{tenths / 10:g}g-gap{gap}",
            ego_speed=to_mps(speed),
            gap=float(gap),
            deceleration=round(tenths / 10 * 9.80665, 6),
            build_up=1.0,
        )
        for speed in (50, 80)
        for tenths in (3, 5)
        for gap in (12, 40)
    )
    return (
        *speed_cases(suite, "CCRs", list(range(10, 90, 10))),
        *speed_cases(suite, "CCRm", list(range(40, 90, 10)), target_speed=to_mps(20)),
        *decelerating,
    )
