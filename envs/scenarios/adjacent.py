"""Other cars in the next lane or leaving and entering ours: nothing calls for braking."""

from math import pi

from lgmd_gym.envs.dynamics.path import Bend, lane_change
from lgmd_gym.envs.dynamics.units import KMH, MAX_SPEED, check_speed, check_within
from lgmd_gym.envs.scenarios.registry import START_TTC, family
from lgmd_gym.envs.scenarios.scenario import (
    EGO_LENGTH,
    EGO_WIDTH,
    LANE_WIDTH,
    TARGET_LENGTH,
    TARGET_WIDTH,
    Actor,
    RoadPlan,
    Scenario,
)

CLEAR = (EGO_WIDTH + TARGET_WIDTH) / 2  # lateral offset at which the two just miss each other [m]
QUEUE_SPACING = 2.0  # [m] between the cars of a queue
SIGHT = 2.0  # [s] more after the last car is passed


@family("AdjacentPass")
def pass_standing(
    ego_speed: float = 50 * KMH,
    lateral_offset: float = LANE_WIDTH,
    cars: int = 1,
    shade: int | None = None,
) -> Scenario:
    """Drive past a car, or a queue of cars, that stands in the next lane.

    Args:
        ego_speed: In (0, 40] [m/s].
        lateral_offset: The standing cars' centreline minus the ego's, + left; beyond touch [m].
        cars: Number of standing cars in a row, in [1, 20].
        shade: Body grey of the standing cars in [0, 255]; None draws each from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    if abs(check_within("lateral_offset", lateral_offset, -20.0, 20.0, "m")) <= CLEAR:
        raise ValueError(
            f"lateral_offset must exceed {CLEAR:g} m to either side in AdjacentPass, got {lateral_offset!r}; "
            "for a car in the way use CCRs"
        )
    count = int(check_within("cars", cars, 1, 20))
    pitch = TARGET_LENGTH + QUEUE_SPACING
    queue = tuple(
        Actor(gap=START_TTC * speed + number * pitch, lateral_offset=lateral_offset, shade=shade)
        for number in range(count)
    )
    length = START_TTC * speed + count * pitch + EGO_LENGTH
    return Scenario(family="AdjacentPass", ego_speed=speed, duration=length / speed + SIGHT, actors=queue)


@family("PassBetween")
def pass_between(ego_speed: float = 80 * KMH, inner_gap: float = 4.5, shade: int | None = None) -> Scenario:
    """Drive between two parked cars, tails aligned (49 CFR 571.127 S9.3 at 80, GB 39901 at 60 km/h).

    Args:
        ego_speed: In (0, 40] [m/s].
        inner_gap: Between the cars' sides, in [2, 10] [m].
        shade: Body grey of the parked cars in [0, 255]; None draws each from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    aside = check_within("inner_gap", inner_gap, 2.0, 10.0, "m") / 2 + TARGET_WIDTH / 2
    gap = max(START_TTC * speed, 50.0)
    parked = tuple(Actor(gap=gap, lateral_offset=side * aside, shade=shade) for side in (1, -1))
    duration = (gap + TARGET_LENGTH + EGO_LENGTH) / speed + SIGHT
    return Scenario(family="PassBetween", ego_speed=speed, duration=duration, actors=parked)


@family("Overtaken")
def being_overtaken(
    ego_speed: float = 80 * KMH, excess: float = 30 * KMH, shade: int | None = None
) -> Scenario:
    """Be overtaken in the lane to the left by a faster car, which appears in the picture from the side.

    Args:
        ego_speed: In (0, 40) [m/s].
        excess: By how much the other car is faster, > 0 [m/s].
        shade: Body grey of the other car in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    faster = check_speed("ego_speed + excess", speed + check_within("excess", excess, 0.1, MAX_SPEED, "m/s"))
    behind = -(EGO_LENGTH + TARGET_LENGTH) - 3.0 * excess  # alongside after three seconds
    other = Actor(gap=behind, lateral_offset=LANE_WIDTH, speed=faster, shade=shade)
    return Scenario(family="Overtaken", ego_speed=speed, duration=10.0, actors=(other,))


@family("Oncoming")
def meet_oncoming(
    ego_speed: float = 80 * KMH, oncoming_speed: float = 80 * KMH, shade: int | None = None
) -> Scenario:
    """Meet a car in the next lane of a two-way road.

    Args:
        ego_speed: In (0, 40] [m/s].
        oncoming_speed: In (0, 40] [m/s].
        shade: Body grey of the other car in [0, 255]; None draws it from the seed.
    """
    speed, towards = check_speed("ego_speed", ego_speed), check_speed("oncoming_speed", oncoming_speed)
    gap = START_TTC * (speed + towards)
    other = Actor(gap=gap, lateral_offset=LANE_WIDTH, heading=pi, speed=towards, shade=shade)
    return Scenario(
        family="Oncoming",
        ego_speed=speed,
        duration=START_TTC + SIGHT,
        actors=(other,),
        road=RoadPlan(kind="two-way"),
    )


@family("CutIn")
def cut_in(
    ego_speed: float = 50 * KMH,
    gap: float = 12.0,
    excess: float = 5 * KMH,
    change_length: float = 44.0,
    shade: int | None = None,
) -> Scenario:
    """A car changes from the left lane into ours, no slower than we are, and leaves a safe gap.

    Args:
        ego_speed: In (0, 40) [m/s].
        gap: Bumper to bumper when the lane change begins, in [2, 200] [m].
        excess: By how much the other car is faster, >= 0 [m/s].
        change_length: Of the lane change along the road, in [10, 200] [m].
        shade: Body grey of the other car in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    faster = check_speed("ego_speed + excess", speed + check_within("excess", excess, 0.0, MAX_SPEED, "m/s"))
    before = 2.0  # [s] beside each other
    other = Actor(
        gap=check_within("gap", gap, 2.0, 200.0, "m") - before * excess,
        lateral_offset=LANE_WIDTH,
        speed=faster,
        path=_changing_lane(before * faster, change_length, -LANE_WIDTH),
        shade=shade,
    )
    return Scenario(family="CutIn", ego_speed=speed, duration=9.0, actors=(other,))


@family("CutOut")
def cut_out(
    ego_speed: float = 50 * KMH, headway: float = 1.5, change_length: float = 44.0, shade: int | None = None
) -> Scenario:
    """The car ahead changes into the left lane; the road behind it is free.

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        headway: Time the ego needs to cover the gap, in [0.3, 10] [s].
        change_length: Of the lane change along the road, in [10, 200] [m].
        shade: Body grey of the other car in [0, 255]; None draws it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    lead = Actor(
        gap=speed * check_within("headway", headway, 0.3, 10.0, "s"),
        speed=speed,
        path=_changing_lane(3.0 * speed, change_length, LANE_WIDTH),
        shade=shade,
    )
    return Scenario(family="CutOut", ego_speed=speed, duration=9.0, actors=(lead,))


def _changing_lane(before: float, length: float, offset: float) -> tuple[Bend, ...]:
    """Return a straight and then a lane change."""
    shift = lane_change(check_within("change_length", length, 10.0, 200.0, "m"), offset)
    return (Bend(before), *shift)
