"""Approaches from behind: Euro NCAP's CCRs, CCRm and CCRb, and following that needs no brake."""

from dataclasses import replace
from math import pi

from lgmd_gym.envs.dynamics.speed_profile import Segment
from lgmd_gym.envs.dynamics.units import KMH, check_speed, check_within, offset_from_overlap
from lgmd_gym.envs.scenarios.registry import AFTERMATH, START_TTC, family
from lgmd_gym.envs.scenarios.scenario import EGO_WIDTH, LANE_WIDTH, TARGET_WIDTH, Actor, Scenario

LEAD_IN = 3.0  # [s] at constant distance before a lead car brakes (T0 is 1 s before: N1 8.2.2.3)
RELEASE = 2.5  # [m/s²], of a lead car that brakes and releases


@family("CCRs")
def approach_standing(
    ego_speed: float = 50 * KMH,
    lateral_offset: float | None = None,
    overlap: float | None = None,
    impact_location: float | None = None,
    target_heading: float = 0.0,
    beside: bool = False,
    shade: int | None = None,
) -> Scenario:
    """Approach a standing car (Car-to-Car Rear stationary).

    Args:
        ego_speed: In (0, 40] [m/s].
        lateral_offset: The target's centreline minus the ego's, + left [m].
        overlap: Instead of it: share of the ego's width in [-1, 1], the sign says the side (2023).
        impact_location: Instead of both: where on the ego's width the target's centre strikes, in
            [-0.25, 1.25], 0.5 is aligned, more is to the left (2026).
        target_heading: Of the target against the ego's, in [-π/2, π/2], + left [rad].
        beside: Whether another car stands beside the target, in the lane to the left.
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    target = Actor(
        gap=START_TTC * speed,
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        heading=check_within("target_heading", target_heading, -pi / 2, pi / 2, "rad"),
        shade=shade,
    )
    duration = START_TTC + AFTERMATH
    return Scenario(family="CCRs", ego_speed=speed, duration=duration, actors=_with_clutter(target, beside))


@family("CCRm")
def approach_slower(
    ego_speed: float = 50 * KMH,
    target_speed: float = 20 * KMH,
    lateral_offset: float | None = None,
    overlap: float | None = None,
    impact_location: float | None = None,
    beside: bool = False,
    shade: int | None = None,
) -> Scenario:
    """Approach a slower car (Car-to-Car Rear moving).

    Args:
        ego_speed: In (0, 40] [m/s].
        target_speed: In (0, ego_speed) [m/s]; the protocols use 20 km/h.
        lateral_offset: The target's centreline minus the ego's, + left [m].
        overlap: Instead of it, see CCRs.
        impact_location: Instead of both, see CCRs.
        beside: Whether another car drives beside the target, in the lane to the left.
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    lead = check_speed("target_speed", target_speed)
    if lead >= speed:
        raise ValueError(f"target_speed must be below ego_speed {speed:g} m/s in CCRm, got {lead:g}")
    target = Actor(
        gap=START_TTC * (speed - lead),
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        speed=lead,
        shade=shade,
    )
    duration = START_TTC + AFTERMATH
    return Scenario(family="CCRm", ego_speed=speed, duration=duration, actors=_with_clutter(target, beside))


@family("CCRb")
def follow_braking(
    ego_speed: float = 50 * KMH,
    gap: float | None = None,
    headway: float | None = None,
    deceleration: float = 6.0,
    build_up: float = 1.0,
    lateral_offset: float | None = None,
    overlap: float | None = None,
    impact_location: float | None = None,
    beside: bool = False,
    shade: int | None = None,
) -> Scenario:
    """Follow a car that brakes to a standstill (Car-to-Car Rear braking).

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        gap: Bumper to bumper while both hold their speed, in [1, 200]; 40 if no headway is given [m].
        headway: Instead of `gap`: time the ego needs to cover it, in [0.3, 10] [s].
        deceleration: Of the target, in [0.5, 10] [m/s²].
        build_up: From its onset to the full deceleration, in [0, 5] [s].
        lateral_offset: The target's centreline minus the ego's, + left [m].
        overlap: Instead of it, see CCRs.
        impact_location: Instead of both, see CCRs.
        beside: Whether another car brakes beside the target, in the lane to the left.
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    strength = check_within("deceleration", deceleration, 0.5, 10.0, "m/s²")
    braking = Segment(
        start=LEAD_IN, acceleration=-strength, build_up=check_within("build_up", build_up, 0.0, 5.0, "s")
    )
    distance = _gap(speed, gap, headway)
    target = Actor(
        gap=distance,
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        speed=speed,
        profile=(braking,),
        shade=shade,
    )
    # The ego covers the gap and the lead car's way to standstill at its scripted speed.
    contact = LEAD_IN + build_up / 2 + speed / (2 * strength) + distance / speed
    return Scenario(
        family="CCRb",
        ego_speed=speed,
        duration=contact + AFTERMATH,
        actors=_with_clutter(target, beside),
    )


@family("Following")
def follow_steadily(ego_speed: float = 50 * KMH, headway: float = 2.0, shade: int | None = None) -> Scenario:
    """Follow a car at constant distance; nothing calls for braking.

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        headway: Time the ego needs to cover the gap, in [0.3, 10] [s].
        shade: Body grey of the lead car in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    gap = speed * check_within("headway", headway, 0.3, 10.0, "s")
    lead = Actor(gap=gap, speed=speed, shade=shade)
    return Scenario(family="Following", ego_speed=speed, duration=10.0, actors=(lead,))


@family("BrakeRelease")
def lead_brakes_and_releases(
    ego_speed: float = 50 * KMH, headway: float = 1.5, speed_drop: float = 5.0, shade: int | None = None
) -> Scenario:
    """Follow a car that brakes and gets away again before it would be hit; nothing calls for braking.

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        headway: Time the ego needs to cover the gap at first, in [0.3, 10] [s].
        speed_drop: By how much the lead car slows down, at 2.5 m/s² there and back [m/s].
        shade: Body grey of the lead car in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    gap = speed * check_within("headway", headway, 0.3, 10.0, "s")
    drop = check_within("speed_drop", speed_drop, 0.1, speed, "m/s")
    lost = drop**2 / RELEASE  # half of it while braking, half while regaining
    if lost >= gap:
        raise ValueError(
            f"speed_drop {drop:g} m/s costs {lost:.1f} m of a gap of {gap:.1f} m; lower it or raise headway"
        )
    slows = Segment(start=LEAD_IN, acceleration=-RELEASE, final_speed=speed - drop)
    regains = Segment(start=LEAD_IN, acceleration=RELEASE, final_speed=speed)
    lead = Actor(gap=gap, speed=speed, profile=(slows, regains), shade=shade)
    return Scenario(family="BrakeRelease", ego_speed=speed, duration=10.0, actors=(lead,))


def _gap(speed: float, gap: float | None, headway: float | None) -> float:
    """Return the gap [m] from the one of the two arguments that was given; 40 m for neither."""
    if headway is None:
        return check_within("gap", 40.0 if gap is None else gap, 1.0, 200.0, "m")
    if gap is not None:
        raise ValueError(f"gap={gap!r} and headway={headway!r} say the same thing twice; pass one")
    return speed * check_within("headway", headway, 0.3, 10.0, "s")


def _with_clutter(target: Actor, beside: bool) -> tuple[Actor, ...]:
    """Return the target, and its twin in the lane to the left if asked for."""
    if not beside:
        return (target,)
    return target, replace(target, lateral_offset=LANE_WIDTH, heading=0.0, shade=None)


def _offset(lateral_offset: float | None, overlap: float | None, impact_location: float | None) -> float:
    """Return the lateral offset [m] from the one of the three arguments that was given; 0 for none."""
    names = ("lateral_offset", "overlap", "impact_location")
    given = {
        name: value
        for name, value in zip(names, (lateral_offset, overlap, impact_location), strict=True)
        if value is not None
    }
    if len(given) > 1:
        said = " and ".join(f"{name}={value!r}" for name, value in given.items())
        raise ValueError(f"{said} say the same thing twice; pass one")
    if overlap is not None:
        return offset_from_overlap(overlap, EGO_WIDTH, TARGET_WIDTH)
    if impact_location is not None:
        # As in the OpenSCENARIO files for Euro NCAP 2026: the share of the ego's width, 0.5 in its middle.
        return (check_within("impact_location", impact_location, -0.25, 1.25) - 0.5) * EGO_WIDTH
    return check_within("lateral_offset", lateral_offset or 0.0, -20.0, 20.0, "m")
