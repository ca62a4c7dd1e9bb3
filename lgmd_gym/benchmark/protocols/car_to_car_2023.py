"""Euro NCAP's test protocol AEB Car-to-Car v4.3.1 (February 2024, implementation 2023), here called N1."""

from dataclasses import replace

from lgmd_gym.benchmark.case import Case, make_case, speed_cases, to_mps

OVERLAPS = (-50, -75, 100, 75, 50)  # N1 8.2.2: per cent of the ego's width; the sign is the side
TAP_SPEEDS = ((10, 15, 20), (30, 45, 60))  # N1 8.2: ego and target speeds of CCFtap [km/h]


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
    straight = [
        make_case(suite, "CCFhos", f"v{speed}", ego_speed=to_mps(speed), target_speed=to_mps(speed))
        for speed in (50, 70)
    ]
    changes = [
        make_case(
            suite,
            "CCFhol",
            f"v{speed}",
            ego_speed=to_mps(speed),
            target_speed=to_mps(speed),
            change_length=length,
            following_distance=distance,
        )
        for speed, length, distance in ((50, 44.0, 13.9), (70, 60.0, 19.4))
    ]
    return (*straight, *changes)
