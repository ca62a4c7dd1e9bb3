"""Rear scenarios: Euro NCAP's CCRs, CCRm and CCRb, and car following without a threat."""

from dataclasses import replace
from math import copysign, pi

from lgmd_gym.envs.dynamics.segment import Segment
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_WIDTH,
    Actor,
    Scenario,
    bridge_shadow,
)
from lgmd_gym.errors import check_flag, check_within, shown

LEAD_IN = (
    3.0  # [s] at constant distance before the lead car brakes; T0 is 1 s before (AEB C2C v4.3.1, 8.2.2.3)
)
RELEASE = 2.5  # [m/s²], deceleration and acceleration of a lead car that brakes and releases


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
    """The ego approaches a stationary car from behind (Car-to-Car Rear stationary).

    Source: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.2; impact locations: Euro NCAP 2026. At most one of
    `lateral_offset`, `overlap` and `impact_location` can be given.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        lateral_offset: Target centreline minus ego centreline, + left, in [-20, 20] [m]; 0 if no position
            is given.
        overlap: Overlapped share of the ego's width, in [-1, 1]; the sign is the side, + left, and ±1 is
            aligned (2023).
        impact_location: Position of the target's centre across the ego's width, in [-0.25, 1.25]; 0.5 is
            aligned, larger values are to the left (2026).
        target_heading: Target heading relative to the ego's, + left, in [-π/2, π/2] [rad].
        beside: Whether a second stationary car is next to the target, in the lane to the left.
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    target = Actor(
        gap=START_TTC * speed,
        lateral_offset=_offset(lateral_offset, overlap, impact_location),
        heading=check_within("target_heading", target_heading, -pi / 2, pi / 2, "rad"),
        shade=shade,
    )
    duration = START_TTC + AFTERMATH
    return Scenario(
        family="CCRs", ego_speed=speed, duration=duration, actors=_with_second_car(target, beside)
    )


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
    """The ego approaches a slower car from behind (Car-to-Car Rear moving).

    Source: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.2, with a target speed of 20 km/h; Euro NCAP Frontal
    Collisions v1.1, 3.1, also with an ego speed of 90 to 130 km/h and a target that is 60 km/h slower.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        target_speed: Target speed, in (0, ego_speed) [m/s].
        lateral_offset: Target centreline minus ego centreline, + left, in [-20, 20] [m].
        overlap: Alternative to `lateral_offset`, as in CCRs.
        impact_location: Alternative to `lateral_offset`, as in CCRs.
        beside: Whether a second car drives next to the target, in the lane to the left.
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
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
    return Scenario(
        family="CCRm", ego_speed=speed, duration=duration, actors=_with_second_car(target, beside)
    )


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
    """The ego follows a car that brakes to a standstill (Car-to-Car Rear braking).

    Source: Euro NCAP AEB Car-to-Car v4.3.1, 8.2.2.3, at 50 km/h with 2 or 6 m/s² and gaps of 12 or 40 m.

    Args:
        ego_speed: Initial speed of both cars, in (0, 40] [m/s].
        gap: Initial bumper-to-bumper distance, in [1, 200] [m]; 40 m without `gap` and `headway`.
        headway: Alternative to `gap`: initial time headway, in [0.3, 10] [s].
        deceleration: Full deceleration of the target, in [0.5, 10] [m/s²].
        build_up: Time from the onset to the full deceleration, in [0, 5] [s].
        lateral_offset: Target centreline minus ego centreline, + left, in [-20, 20] [m].
        overlap: Alternative to `lateral_offset`, as in CCRs.
        impact_location: Alternative to `lateral_offset`, as in CCRs.
        beside: Whether a second car brakes next to the target, in the lane to the left.
        shade: Grey level of the target in [0, 255]; None to draw it from the seed.
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
    # At its scripted speed the ego covers the gap and the lead car's stopping distance.
    contact = LEAD_IN + build_up / 2 + speed / (2 * strength) + distance / speed
    return Scenario(
        family="CCRb",
        ego_speed=speed,
        duration=contact + AFTERMATH,
        actors=_with_second_car(target, beside),
    )


@family("Following")
def follow_steadily(ego_speed: float = 50 * KMH, headway: float = 2.0, shade: int | None = None) -> Scenario:
    """The ego follows a car at a constant distance; not a threat.

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        headway: Time headway, in [0.3, 10] [s].
        shade: Grey level of the lead car in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    gap = speed * check_within("headway", headway, 0.3, 10.0, "s")
    lead = Actor(gap=gap, speed=speed, shade=shade)
    return Scenario(family="Following", ego_speed=speed, duration=10.0, actors=(lead,))


@family("BrakeRelease")
def lead_brakes_and_releases(
    ego_speed: float = 50 * KMH,
    headway: float = 1.5,
    speed_drop: float = 5.0,
    shadow_length: float = 0.0,
    shade: int | None = None,
) -> Scenario:
    """The ego follows a car that brakes briefly and regains its speed without contact; not a threat.

    With a bridge's shadow, the lead car begins to brake as it reaches the shadow: brake lights, a shorter
    distance and a dark edge on the road come at the same time.

    Args:
        ego_speed: Initial speed of both cars, in (0, 40] [m/s].
        headway: Initial time headway, in [0.3, 10] [s].
        speed_drop: Speed that the lead car loses and regains at 2.5 m/s², in [0.1, ego_speed] [m/s].
        shadow_length: Length of a bridge's shadow along the road, in [0, 100]; 0 for none [m].
        shade: Grey level of the lead car in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    gap = speed * check_within("headway", headway, 0.3, 10.0, "s")
    drop = check_within("speed_drop", speed_drop, 0.1, speed, "m/s")
    lost = drop**2 / RELEASE  # half while braking, half while accelerating
    if lost >= gap:
        raise ValueError(
            f"speed_drop {drop:g} m/s reduces the gap of {gap:.1f} m by {lost:.1f} m; "
            "lower it or raise headway"
        )
    braking = Segment(start=LEAD_IN, acceleration=-RELEASE, final_speed=speed - drop)
    accelerating = Segment(start=LEAD_IN, acceleration=RELEASE, final_speed=speed)
    actors = [Actor(gap=gap, speed=speed, profile=(braking, accelerating), shade=shade)]
    if check_within("shadow_length", shadow_length, 0.0, 100.0, "m") > 0.0:
        actors.append(bridge_shadow(gap + LEAD_IN * speed, shadow_length))
    return Scenario(family="BrakeRelease", ego_speed=speed, duration=10.0, actors=tuple(actors))


def _gap(speed: float, gap: float | None, headway: float | None) -> float:
    """Return the gap [m] from `gap` or `headway`; 40 m if both are None."""
    if headway is None:
        return check_within("gap", 40.0 if gap is None else gap, 1.0, 200.0, "m")
    if gap is not None:
        raise ValueError(f"gap={shown(gap)} and headway={shown(headway)} both set the distance; pass one")
    return speed * check_within("headway", headway, 0.3, 10.0, "s")


def _with_second_car(target: Actor, beside: bool) -> tuple[Actor, ...]:
    """Return the target, with a copy of it in the lane to the left if `beside`."""
    if not check_flag("beside", beside):
        return (target,)
    return target, replace(target, lateral_offset=LANE_WIDTH, heading=0.0, shade=None)


def _offset(lateral_offset: float | None, overlap: float | None, impact_location: float | None) -> float:
    """Return the lateral offset [m] from one of the three arguments; 0 if all are None."""
    names = ("lateral_offset", "overlap", "impact_location")
    given = {
        name: value
        for name, value in zip(names, (lateral_offset, overlap, impact_location), strict=True)
        if value is not None
    }
    if len(given) > 1:
        text = " and ".join(f"{name}={shown(value)}" for name, value in given.items())
        raise ValueError(f"{text} both set the lateral position; pass one")
    if overlap is not None:
        return _offset_from_overlap(overlap)
    if impact_location is not None:
        # As in the OpenSCENARIO files of Euro NCAP 2026: 0 and 1 are the ego's sides, 0.5 its centreline.
        return (check_within("impact_location", impact_location, -0.25, 1.25) - 0.5) * EGO_WIDTH
    return check_within("lateral_offset", 0.0 if lateral_offset is None else lateral_offset, -20.0, 20.0, "m")


def _offset_from_overlap(overlap: float) -> float:
    """Return the lateral offset [m] for an overlap as defined in Euro NCAP AEB C2C v4.3.1, 3.4."""
    share = check_within("overlap", overlap, -1.0, 1.0)
    if abs(share) == 1.0:
        return 0.0
    return copysign((EGO_WIDTH + TARGET_WIDTH) / 2 - abs(share) * EGO_WIDTH, share)
