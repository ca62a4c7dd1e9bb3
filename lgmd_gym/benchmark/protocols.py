"""The grids of the emergency-braking protocols, as cases; numbers only, each with its source.

N1 is Euro NCAP's test protocol AEB Car-to-Car v4.3.1 (February 2024, implementation 2023).
"""

from dataclasses import replace
from math import radians
from typing import Any

from lgmd_gym.benchmark.case import Case, cases, metres, one

OVERLAPS = (-50, -75, 100, 75, 50)  # N1 8.2.2: per cent of the ego's width; the sign is the side
LOCATIONS_2026 = (100, 75, 50, 25, 0)  # per cent of the ego's width; 125 and -25 are the extended range
R152_TARGET = 20  # km/h, UN R152 6.5


def overlap_tail(per_cent: int) -> str:
    """Return the part of a case's name that tells the overlap."""
    return f"/overlap{per_cent}"


def ncap2023() -> tuple[Case, ...]:
    """N1 8.2: 45 CCRs AEB cells, 30 CCRs cells with a warned driver, 55 CCRm, 4 CCRb, 30 CCCscp."""
    suite = "ncap2023"
    aeb = list(range(10, 55, 5))
    warned = list(range(55, 85, 5))
    moving = list(range(30, 85, 5))
    rows: list[Case] = []
    for family, speeds in (("CCRs", aeb), ("CCRm", moving)):
        for per_cent in OVERLAPS:
            rows += cases(suite, family, speeds, overlap_tail(per_cent), overlap=per_cent / 100)
    for per_cent in OVERLAPS:
        tail = f"-warned{overlap_tail(per_cent)}"
        cells = cases(suite, "CCRs", warned, tail, overlap=per_cent / 100)
        rows += [replace(cell, fcw_driver=True) for cell in cells]
    return (*rows, *braking_lead(suite), *_crossing(suite))


def ncap2026() -> tuple[Case, ...]:
    """Euro NCAP Crash Avoidance - Frontal Collisions v1.1, 3.1: the rear scenarios' standard range.

    An impact location of p per cent puts the target's centre at (p - 50) per cent of the ego's width
    from its centreline, + left, as the OpenSCENARIO files for that protocol do; the official calculator names
    locations and leaves their geometry open. CCRb: headway 1.0 s, 4 m/s² within 1.0 s. The robustness layer
    (5.2.1.3) adds, aligned: a turned target, a car beside it, night, and for CCRb 2 m/s² more or less and
    0.5 s of headway more or less. Its glare is not built.
    """
    suite = "ncap2026"
    rows: list[Case] = []
    for per_cent in LOCATIONS_2026:
        tail, where = f"/location{per_cent}", per_cent / 100
        rows += cases(suite, "CCRs", list(range(10, 60, 10)), tail, impact_location=where)
        rows += cases(suite, "CCRm", list(range(30, 90, 10)), tail, impact_location=where)
        rows += cases(
            suite, "CCRb", list(range(30, 90, 10)), tail, headway=1.0, deceleration=4.0, impact_location=where
        )
        warned = cases(suite, "CCRs", list(range(60, 90, 10)), f"-warned{tail}", impact_location=where)
        rows += [replace(cell, fcw_driver=True) for cell in warned]
    for degrees_left in (-20, -10, 10, 20):
        turned = round(radians(degrees_left), 6)
        rows += cases(
            suite,
            "CCRs",
            [30, 50],
            f"/robust-heading{degrees_left}",
            impact_location=0.5,
            target_heading=turned,
        )
    lead: dict[str, Any] = {"headway": 1.0, "deceleration": 4.0}
    for family, more in (("CCRs", {}), ("CCRm", {}), ("CCRb", lead)):
        rows += cases(suite, family, [30, 50], "/robust-beside", impact_location=0.5, beside=True, **more)
        night = {"impact_location": 0.5, "condition": "night", **more}
        rows += cases(suite, family, [30, 50], "/robust-night", **night)
    for what, change in (
        ("decel2", {"deceleration": 2.0}),
        ("decel6", {"deceleration": 6.0}),
        ("headway0.5", {"headway": 0.5}),
        ("headway1.5", {"headway": 1.5}),
    ):
        rows += cases(suite, "CCRb", [50], f"/robust-{what}", impact_location=0.5, **(lead | change))
    return tuple(rows)


def braking_lead(suite: str) -> tuple[Case, ...]:
    """N1 8.2.2.3: CCRb, both at 50 km/h, 2 and 6 m/s² at 12 and 40 m; the deceleration stands after 1 s."""
    return tuple(
        one(
            suite,
            "CCRb",
            f"v50/brake{strength}-gap{gap}",
            ego_speed=metres(50),
            gap=float(gap),
            deceleration=float(strength),
            build_up=1.0,
        )
        for strength in (2, 6)
        for gap in (12, 40)
    )


def _crossing(suite: str) -> tuple[Case, ...]:
    """N1 8.2.5: CCCscp, from a stop 2.9 m off and at 20 to 60 km/h, target at 20 to 60 km/h.

    The target comes from the far side, the left, which the OpenSCENARIO file for 2026 has as its default.
    """
    targets = range(20, 70, 10)
    started = [
        one(
            suite,
            "CCCscp",
            f"from-stop/target{target}",
            ego_speed=metres(20),
            target_speed=metres(target),
            side="left",
            from_stop=True,
        )
        for target in targets
    ]
    moving = [
        one(
            suite,
            "CCCscp",
            f"v{speed}/target{target}",
            ego_speed=metres(speed),
            target_speed=metres(target),
            side="left",
        )
        for speed in range(20, 70, 10)
        for target in targets
    ]
    return (*started, *moving)


def r152() -> tuple[Case, ...]:
    """UN R152 Rev.2, 6.4 and 6.5: standing target at 20, 40, 42, 60, moving target at 30 and 60 km/h.

    40 km/h is driven at maximum mass and 42 in running order; the brake here does not know the mass, so
    that the load states differ by their limits alone.
    """
    return (
        *cases("r152", "CCRs", [20, 40, 42, 60]),
        *cases("r152", "CCRm", [30, 60], target_speed=metres(R152_TARGET)),
    )


def fmvss127() -> tuple[Case, ...]:
    """49 CFR 571.127 S7.3 to S7.5 without manual braking: stopped, slower, decelerating lead vehicle.

    The deceleration stands 1.0 s after its onset (S7.5 allows up to 1.5 s).
    """
    suite = "fmvss127"
    decelerating = tuple(
        one(
            suite,
            "CCRb",
            f"v{speed}/brake{tenths / 10:g}g-gap{gap}",
            ego_speed=metres(speed),
            gap=float(gap),
            deceleration=round(tenths / 10 * 9.80665, 6),
            build_up=1.0,
        )
        for speed in (50, 80)
        for tenths in (3, 5)
        for gap in (12, 40)
    )
    return (
        *cases(suite, "CCRs", list(range(10, 90, 10))),
        *cases(suite, "CCRm", list(range(40, 90, 10)), target_speed=metres(20)),
        *decelerating,
    )
