"""UN R152 Rev.2 and 49 CFR 571.127 (FMVSS 127)."""

from lgmd_gym.benchmark.case import Case, make_case, speed_cases, to_mps

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


def r152_vru() -> tuple[Case, ...]:
    """Return the cases of UN R152 6.6 (a child crosses at 5 km/h) and 6.7 (a bicycle crosses at 15 km/h).

    The impact points are on the ego's centreline. 40 km/h (pedestrian) and 38 km/h (bicycle) are tested at
    maximum mass, 42 and 40 km/h in running order; see `r152`.
    """
    suite = "r152-vru"
    return (
        *speed_cases(suite, "CPNA", [20, 40, 42, 60], walking_speed=to_mps(5), child=True),
        *speed_cases(suite, "CBNA", [20, 38, 40, 60], bicycle_speed=to_mps(15), obstructed=False),
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
    for beam, condition in BEAMS.items():
        rows += speed_cases(suite, "CPNA", crossing, f"/right50-{beam}", condition=condition)
        rows += speed_cases(suite, "CPLA", standing, f"/standing-{beam}", **STANDING, condition=condition)
        rows += speed_cases(suite, "CPLA", along, f"/along-{beam}", **ALONG, condition=condition)
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
