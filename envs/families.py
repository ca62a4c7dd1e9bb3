"""The scenario families: SI arguments in, one `Scenario` out. Each name here is an id `LGMD/<name>-v0`.

A run starts 5 s before the first possible contact at the scripted speeds: 1 s of undisturbed driving before
the protocols' T0 at 4 s time to contact, so that braking at once counts as premature.
"""

import inspect
from collections.abc import Callable

from lgmd_gym.envs.scenario import EGO_WIDTH, LANE_WIDTH, TARGET_WIDTH, Actor, Phase, Scenario
from lgmd_gym.envs.units import KMH, check_speed, check_within, offset_from_overlap
from lgmd_gym.errors import check_keys, unknown_name

START_TTC = 5.0  # [s]
AFTERMATH = 6.0  # [s] past the scripted contact, for a slow stop to be seen to its end
LEAD_IN = 3.0  # [s] at constant distance before a lead car brakes (T0 is 1 s before: N1 8.2.2.3)

FAMILIES: dict[str, Callable[..., Scenario]] = {}


def family(name: str) -> Callable[[Callable[..., Scenario]], Callable[..., Scenario]]:
    """Enter a scenario function into `FAMILIES`; a name is given once."""

    def enter(function: Callable[..., Scenario]) -> Callable[..., Scenario]:
        if name in FAMILIES:
            raise ValueError(f"scenario family {name!r} is defined twice")
        FAMILIES[name] = function
        return function

    return enter


def make_scenario(name: str, **arguments: object) -> Scenario:
    """Return the scenario of a family.

    Raises:
        ValueError: For an unknown family or argument (naming the nearest), or a value out of its range.
    """
    if name not in FAMILIES:
        raise unknown_name("scenario", name, FAMILIES)
    function = FAMILIES[name]
    check_keys(f"argument of {name}", arguments, inspect.signature(function).parameters)
    return function(**arguments)


@family("CCRs")
def approach_standing(
    ego_speed: float = 50 * KMH,
    lateral_offset: float | None = None,
    overlap: float | None = None,
    shade: int | None = None,
) -> Scenario:
    """Approach a standing car (Car-to-Car Rear stationary).

    Args:
        ego_speed: In (0, 40] [m/s].
        lateral_offset: The target's centreline minus the ego's, + left [m].
        overlap: Instead of `lateral_offset`: share of the ego's width in [-1, 1].
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    offset = _offset(lateral_offset, overlap)
    target = Actor(gap=START_TTC * speed, lateral_offset=offset, shade=shade)
    return Scenario(family="CCRs", ego_speed=speed, duration=START_TTC + AFTERMATH, actors=(target,))


@family("CCRm")
def approach_slower(
    ego_speed: float = 50 * KMH,
    target_speed: float = 20 * KMH,
    lateral_offset: float | None = None,
    overlap: float | None = None,
    shade: int | None = None,
) -> Scenario:
    """Approach a slower car (Car-to-Car Rear moving).

    Args:
        ego_speed: In (0, 40] [m/s].
        target_speed: In (0, ego_speed) [m/s]; the protocols use 20 km/h.
        lateral_offset: The target's centreline minus the ego's, + left [m].
        overlap: Instead of `lateral_offset`: share of the ego's width in [-1, 1].
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    lead = check_speed("target_speed", target_speed)
    if lead >= speed:
        raise ValueError(f"target_speed must be below ego_speed {speed:g} m/s in CCRm, got {lead:g}")
    offset = _offset(lateral_offset, overlap)
    target = Actor(gap=START_TTC * (speed - lead), lateral_offset=offset, speed=lead, shade=shade)
    return Scenario(family="CCRm", ego_speed=speed, duration=START_TTC + AFTERMATH, actors=(target,))


@family("CCRb")
def follow_braking(
    ego_speed: float = 50 * KMH,
    gap: float = 40.0,
    deceleration: float = 6.0,
    build_up: float = 1.0,
    lateral_offset: float | None = None,
    overlap: float | None = None,
    shade: int | None = None,
) -> Scenario:
    """Follow a car that brakes to a standstill (Car-to-Car Rear braking).

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        gap: Bumper to bumper while both hold their speed, in [1, 200] [m].
        deceleration: Of the target, in [0.5, 10] [m/s²].
        build_up: From its onset to the full deceleration, in [0, 5] [s].
        lateral_offset: The target's centreline minus the ego's, + left [m].
        overlap: Instead of `lateral_offset`: share of the ego's width in [-1, 1].
        shade: Body grey of the target in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    strength = check_within("deceleration", deceleration, 0.5, 10.0, "m/s²")
    braking = Phase(
        start=LEAD_IN, acceleration=-strength, build_up=check_within("build_up", build_up, 0.0, 5.0, "s")
    )
    target = Actor(
        gap=check_within("gap", gap, 1.0, 200.0, "m"),
        lateral_offset=_offset(lateral_offset, overlap),
        speed=speed,
        profile=(braking,),
        shade=shade,
    )
    # The ego covers the gap and the lead car's way to standstill at its scripted speed.
    contact = LEAD_IN + build_up / 2 + speed / (2 * strength) + gap / speed
    return Scenario(family="CCRb", ego_speed=speed, duration=contact + AFTERMATH, actors=(target,))


@family("AdjacentPass")
def pass_standing(
    ego_speed: float = 50 * KMH, lateral_offset: float = LANE_WIDTH, shade: int | None = None
) -> Scenario:
    """Drive past a car that stands in the next lane; nothing calls for braking.

    Args:
        ego_speed: In (0, 40] [m/s].
        lateral_offset: The standing car's centreline minus the ego's, + left; beyond touch [m].
        shade: Body grey of the standing car in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    clear = (EGO_WIDTH + TARGET_WIDTH) / 2
    if abs(check_within("lateral_offset", lateral_offset, -20.0, 20.0, "m")) <= clear:
        raise ValueError(
            f"lateral_offset must exceed {clear:g} m to either side in AdjacentPass, got {lateral_offset!r}; "
            "for a car in the way use CCRs"
        )
    parked = Actor(gap=START_TTC * speed, lateral_offset=lateral_offset, shade=shade)
    return Scenario(family="AdjacentPass", ego_speed=speed, duration=START_TTC + AFTERMATH, actors=(parked,))


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


@family("EmptyRoad")
def drive_alone(ego_speed: float = 50 * KMH) -> Scenario:
    """Drive along an empty road; nothing calls for braking.

    Args:
        ego_speed: In (0, 40] [m/s].
    """
    return Scenario(family="EmptyRoad", ego_speed=check_speed("ego_speed", ego_speed), duration=10.0)


def _offset(lateral_offset: float | None, overlap: float | None) -> float:
    """Return the lateral offset from the one of the two arguments that was given; 0 for neither."""
    if overlap is None:
        offset = 0.0 if lateral_offset is None else lateral_offset
        return check_within("lateral_offset", offset, -20.0, 20.0, "m")
    if lateral_offset is not None:
        raise ValueError(
            f"lateral_offset={lateral_offset!r} and overlap={overlap!r} say the same thing twice; pass one"
        )
    return offset_from_overlap(overlap, EGO_WIDTH, TARGET_WIDTH)
