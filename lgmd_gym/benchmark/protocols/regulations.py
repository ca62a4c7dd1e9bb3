"""UN R152 Rev.2, 49 CFR 571.127 (FMVSS 127) and NHTSA's manoeuvres, with limits of rows; not a rating."""

from dataclasses import replace
from typing import Any

from lgmd_gym.benchmark.case import Case, Row, Suite, make_case, relative_impact, speed_cases, to_mps
from lgmd_gym.envs.dynamics.units import KMH

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
R152_TARGET = 20  # km/h, UN R152 6.5
STANDING = {"walking_speed": 0.0, "impact_location": 0.25}
ALONG = {"walking_speed": to_mps(5), "impact_location": 0.25}
BEAMS = {"lower": "night", "upper": "night_upper_beam"}  # conditions of the tests in darkness


def r152() -> tuple[Case, ...]:
    """Return the cases of UN R152 6.4 (stationary target, 20 to 60 km/h) and 6.5 (moving, 30 and 60).

    40 km/h is tested at maximum mass and 42 km/h in running order. The brake model has no mass, so the load
    states differ only in their limits.
    """
    return (
        *_loaded("r152", "CCRs", [20, 40, 42, 60], laden=40),
        *_loaded("r152", "CCRm", [30, 60], target_speed=to_mps(R152_TARGET)),
    )


def _loaded(
    suite: str, family: str, speeds: list[int], laden: int | None = None, **arguments: Any
) -> tuple[Case, ...]:
    """Return cases in running order, except for one speed at maximum mass.

    The regulation tests this speed laden only and the others in both states; unladen is the stricter one.
    """
    cases = speed_cases(suite, family, speeds, **arguments)
    return tuple(
        replace(case, load="laden" if speed == laden else "unladen")
        for case, speed in zip(cases, speeds, strict=True)
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


def r152_vru() -> tuple[Case, ...]:
    """Return the cases of UN R152 6.6 (a child crosses at 5 km/h) and 6.7 (a bicycle crosses at 15 km/h).

    The impact points are on the ego's centreline. 40 km/h (pedestrian) and 38 km/h (bicycle) are tested at
    maximum mass, 42 and 40 km/h in running order; see `r152`.
    """
    suite = "r152-vru"
    return (
        *_loaded(suite, "CPNA", [20, 40, 42, 60], 40, walking_speed=to_mps(5), child=True),
        *_loaded(suite, "CBNA", [20, 38, 40, 60], 38, bicycle_speed=to_mps(15), obstructed=False),
    )


def fmvss127_pedestrian() -> tuple[Case, ...]:
    """Return the cases of 49 CFR 571.127 S8, table 2, in steps of 10 km/h and at the highest speed.

    The overlap is measured from the right; from the left it is 50 %. In darkness either beam is on.
    """
    suite = "fmvss127-pedestrian"
    crossing, standing, along = list(range(10, 70, 10)), [*range(10, 60, 10), 55], [*range(10, 70, 10), 65]
    rows = [
        *speed_cases(suite, "CPNA", crossing, "/right25", impact_location=0.25),
        *speed_cases(suite, "CPNA", crossing, "/right50"),
        *speed_cases(suite, "CPFA", crossing, "/left50"),
        *speed_cases(suite, "CPNCO", list(range(10, 60, 10)), "/right50"),
        *speed_cases(suite, "CPLA", standing, "/standing", **STANDING),
        *speed_cases(suite, "CPLA", along, "/along", **ALONG),
    ]
    for beam, weather in BEAMS.items():
        rows += speed_cases(suite, "CPNA", crossing, f"/right50-{beam}", weather=weather)
        rows += speed_cases(suite, "CPLA", standing, f"/standing-{beam}", **STANDING, weather=weather)
        rows += speed_cases(suite, "CPLA", along, f"/along-{beam}", **ALONG, weather=weather)
    return tuple(rows)


def nhtsa_manoeuvres() -> tuple[Case, ...]:
    """Return seven of NHTSA's eight manoeuvres for false activations, each at 25 and 45 mph.

    NHTSA tested at two speeds, which the summary of its report does not state: these are assumptions. The
    roadside has six parked cars, 0.3 m beside the lane. Driving under a bridge is left out.
    """
    suite, rows = "nhtsa-false-activation", list[Case]()
    for mph, kmh in ((25, 40.2), (45, 72.4)):
        for family, variant, arguments in (
            ("SteelPlate", "", {}),
            ("BottsDots", "", {}),
            ("AdjacentBraking", "/straight", {}),
            ("AdjacentBraking", "/curve", {"radius": 200.0}),
            ("CurveStandingCar", "/entrance", {"place": "entrance"}),
            ("CurveStandingCar", "/exit", {"place": "exit"}),
            ("AdjacentPass", "/roadside", {"lateral_offset": -2.906, "cars": 6}),
        ):
            rows.append(make_case(suite, family, f"{mph}mph{variant}", ego_speed=to_mps(kmh), **arguments))
    return tuple(rows)


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


def check_r152(row: Row) -> tuple[bool, str]:
    """Compare a row of suite r152 or r152-vru with the impact speed limit of its relative speed and load.

    The relative speed to a crossing pedestrian or bicycle is that of the ego. Premature braking fails,
    because it begins before the start of the test (T0).
    """
    load, target = row["load"] or "unladen", _r152_target(row)
    along = (row["target_speed"] or 0.0) if target == "car" else 0.0
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


def meets_r152(rows: list[Row], agent: str) -> bool:
    """Return whether an agent meets the impact speed limits of UN R152 in simulation.

    As in 6.10.1, at most 10 % of all runs with cars and with pedestrians, and 20 % with bicycles, may fail.
    """
    threats = [row for row in rows if row["agent"] == agent and row["error"] is None and row["threat"]]
    for target, share in R152_FAILURES.items():
        met = [check_r152(row)[0] for row in threats if _r152_target(row) == target]
        if len(met) - sum(met) > share * len(met):
            return False
    return bool(threats)


def _r152_target(row: Row) -> str:
    return R152_TARGETS.get(row["family"], "car")


def meets_fmvss127(rows: list[Row], agent: str) -> bool:
    """Return whether an agent has no contact and no premature braking in any run of its rows."""
    threats = [row for row in rows if row["agent"] == agent and row["error"] is None and row["threat"]]
    return bool(threats) and all(check_fmvss127(row)[0] for row in threats)


NO_CONTACT = "the requirement of FMVSS 127 of no contact (S5.1.3, S5.2.3)", meets_fmvss127
VERDICT = "the impact speed limits of UN R152", meets_r152
SUITES = (
    Suite(
        name="r152",
        cases=r152(),
        about="UN R152 car-to-car tests, for the impact-speed limits of 5.2.1.4 only",
        limit=check_r152,
        verdict=VERDICT,
    ),
    Suite(
        name="fmvss127",
        cases=fmvss127(),
        about="49 CFR 571.127 lead-vehicle tests without manual braking, without its warning requirement",
        limit=check_fmvss127,
        verdict=NO_CONTACT,
    ),
    Suite(
        name="r152-vru",
        cases=r152_vru(),
        about="UN R152 pedestrian and bicycle tests, for the impact-speed limits only",
        limit=check_r152,
        verdict=VERDICT,
    ),
    Suite(
        name="fmvss127-pedestrian",
        cases=fmvss127_pedestrian(),
        about="49 CFR 571.127 pedestrian tests by day and with the lower and the upper beam",
        limit=check_fmvss127,
        verdict=NO_CONTACT,
    ),
    Suite(
        name="nhtsa-false-activation",
        cases=nhtsa_manoeuvres(),
        about="seven track manoeuvres of NHTSA in which braking is a false activation",
    ),
)
