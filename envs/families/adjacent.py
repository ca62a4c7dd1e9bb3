"""Cars in adjacent lanes, cut-ins and cut-outs: driving without a threat."""

from math import pi

from lgmd_gym.envs.dynamics.bend import Bend, lane_change
from lgmd_gym.envs.dynamics.units import KMH, MAX_SPEED, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_LENGTH,
    EGO_WIDTH,
    LANE_WIDTH,
    START_TTC,
    TARGET_LENGTH,
    TARGET_TRACK,
    TARGET_WIDTH,
    TYRE_WIDTH,
    Actor,
    RoadPlan,
    Scenario,
)
from lgmd_gym.errors import check_whole, check_within, shown

CONTACT_OFFSET = (EGO_WIDTH + TARGET_WIDTH) / 2  # [m], lateral offset up to which the cars touch
QUEUE_SPACING = 2.0  # [m] between the cars of a queue
AFTER_PASSING = 2.0  # [s] of driving after the last car
CHANGE_START = 2.0  # [s] after which a car that cuts in leaves its lane
MIN_CLOSING = 0.5  # [m/s], slowest approach to a car that cuts in; slower ones take minutes


@family("AdjacentPass")
def pass_standing(
    ego_speed: float = 50 * KMH,
    lateral_offset: float = LANE_WIDTH,
    cars: int = 1,
    shade: int | None = None,
) -> Scenario:
    """The ego passes a stationary car or a queue of cars in the adjacent lane; not a threat.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        lateral_offset: Centreline of the stationary cars minus ego centreline, + left, in [-20, 20] and far
            enough to avoid contact [m].
        cars: Number of stationary cars in the queue, in [1, 20].
        shade: Grey level of the stationary cars in [0, 255]; None to draw each from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    if abs(check_within("lateral_offset", lateral_offset, -20.0, 20.0, "m")) <= CONTACT_OFFSET:
        raise ValueError(
            f"lateral_offset must exceed {CONTACT_OFFSET:g} m to either side in AdjacentPass, "
            f"got {shown(lateral_offset)}; for a car in the ego's path use CCRs"
        )
    count = check_whole("cars", cars, 1, 20)
    pitch = TARGET_LENGTH + QUEUE_SPACING
    queue = tuple(
        Actor(gap=START_TTC * speed + number * pitch, lateral_offset=lateral_offset, shade=shade)
        for number in range(count)
    )
    length = START_TTC * speed + count * pitch + EGO_LENGTH
    return Scenario(
        family="AdjacentPass", ego_speed=speed, duration=length / speed + AFTER_PASSING, actors=queue
    )


@family("PassBetween")
def pass_between(
    ego_speed: float = 80 * KMH,
    wheel_gap: float | None = None,
    inner_gap: float | None = None,
    shade: int | None = None,
) -> Scenario:
    """The ego drives between two parked cars with aligned rears; not a threat.

    Source: 49 CFR 571.127 S9.3.1 at 80 km/h, with 4.5 m between the closest front wheels of the parked cars;
    GB 39901-2025 at 60 km/h, with 4.5 m between their inner sides. At most one of both gaps can be given.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        wheel_gap: Distance between the facing outer sides of the parked cars' closest front tyres, in [2, 10]
            [m]; 4.5 m without `wheel_gap` and `inner_gap`.
        inner_gap: Distance between the inner sides of the parked cars, in [2, 10] [m].
        shade: Grey level of the parked cars in [0, 255]; None to draw each from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    aside = _parked_offset(wheel_gap, inner_gap)
    gap = max(START_TTC * speed, 50.0)
    parked = tuple(Actor(gap=gap, lateral_offset=side * aside, shade=shade) for side in (1, -1))
    duration = (gap + TARGET_LENGTH + EGO_LENGTH) / speed + AFTER_PASSING
    return Scenario(family="PassBetween", ego_speed=speed, duration=duration, actors=parked)


def _parked_offset(wheel_gap: float | None, inner_gap: float | None) -> float:
    """Return the distance of each parked car's centreline from the ego's [m]."""
    if inner_gap is None:
        between = check_within("wheel_gap", 4.5 if wheel_gap is None else wheel_gap, 2.0, 10.0, "m")
        return between / 2 + (TARGET_TRACK + TYRE_WIDTH) / 2
    if wheel_gap is not None:
        raise ValueError("wheel_gap and inner_gap cannot both be given in PassBetween; remove one")
    return check_within("inner_gap", inner_gap, 2.0, 10.0, "m") / 2 + TARGET_WIDTH / 2


@family("Overtaken")
def being_overtaken(
    ego_speed: float = 80 * KMH, excess: float = 30 * KMH, shade: int | None = None
) -> Scenario:
    """A faster car overtakes the ego in the left lane and enters the image from the side; not a threat.

    Args:
        ego_speed: Ego speed, in (0, 40) [m/s].
        excess: Speed of the other car minus ego speed, >= 0.1 [m/s].
        shade: Grey level of the other car in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    faster = check_speed("ego_speed + excess", speed + check_within("excess", excess, 0.1, MAX_SPEED, "m/s"))
    behind = -(EGO_LENGTH + TARGET_LENGTH) - 3.0 * excess  # next to the ego after 3 s
    other = Actor(gap=behind, lateral_offset=LANE_WIDTH, speed=faster, shade=shade)
    return Scenario(family="Overtaken", ego_speed=speed, duration=10.0, actors=(other,))


@family("Oncoming")
def meet_oncoming(
    ego_speed: float = 80 * KMH, oncoming_speed: float = 80 * KMH, shade: int | None = None
) -> Scenario:
    """The ego meets an oncoming car in the adjacent lane of a two-way road; not a threat.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        oncoming_speed: Speed of the oncoming car, in (0, 40] [m/s].
        shade: Grey level of the other car in [0, 255]; None to draw it from the seed.
    """
    speed, oncoming = check_speed("ego_speed", ego_speed), check_speed("oncoming_speed", oncoming_speed)
    gap = START_TTC * (speed + oncoming)
    other = Actor(gap=gap, lateral_offset=LANE_WIDTH, heading=pi, speed=oncoming, shade=shade)
    return Scenario(
        family="Oncoming",
        ego_speed=speed,
        duration=START_TTC + AFTER_PASSING,
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
    """A car changes from the left lane into the ego's lane; a threat only if it is slower than the ego.

    The lane change begins after 2 s. With a slower car it begins later if needed, so that the ego covers the
    gap at least 5 s after the start. A much slower car is passed before it reaches the ego's lane.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        gap: Bumper-to-bumper distance at the start of the lane change, in [2, 200] [m].
        excess: Speed of the other car minus ego speed, >= 0 or <= -0.5 [m/s].
        change_length: Length of the lane change along the road, in [10, 200] [m].
        shade: Grey level of the other car in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    distance = check_within("gap", gap, 2.0, 200.0, "m")
    difference = check_within("excess", excess, -MAX_SPEED, MAX_SPEED, "m/s")
    if -MIN_CLOSING < difference < 0.0:
        raise ValueError(f"excess must be >= 0 or <= -{MIN_CLOSING:g} m/s in CutIn, got {shown(excess)}")
    target_speed = check_speed("ego_speed + excess", speed + difference)
    before, duration = CHANGE_START, 9.0  # [s] in adjacent lanes; of the episode
    if difference < 0.0:
        closing = distance / -difference  # [s] from the start of the lane change
        before = max(CHANGE_START, START_TTC - closing)
        duration = before + closing + AFTERMATH
    other = Actor(
        gap=distance - before * difference,
        lateral_offset=LANE_WIDTH,
        speed=target_speed,
        path=_straight_then_change(before * target_speed, change_length, -LANE_WIDTH),
        shade=shade,
    )
    return Scenario(family="CutIn", ego_speed=speed, duration=duration, actors=(other,))


@family("CutOut")
def cut_out(
    ego_speed: float = 50 * KMH, headway: float = 1.5, change_length: float = 44.0, shade: int | None = None
) -> Scenario:
    """The lead car changes into the left lane and leaves a free road; not a threat.

    Args:
        ego_speed: Speed of both cars, in (0, 40] [m/s].
        headway: Time headway, in [0.3, 10] [s].
        change_length: Length of the lane change along the road, in [10, 200] [m].
        shade: Grey level of the other car in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    lead = Actor(
        gap=speed * check_within("headway", headway, 0.3, 10.0, "s"),
        speed=speed,
        path=_straight_then_change(3.0 * speed, change_length, LANE_WIDTH),
        shade=shade,
    )
    return Scenario(family="CutOut", ego_speed=speed, duration=9.0, actors=(lead,))


def _straight_then_change(before: float, length: float, offset: float) -> tuple[Bend, ...]:
    """Return a straight followed by a lane change."""
    shift = lane_change(check_within("change_length", length, 10.0, 200.0, "m"), offset)
    return (Bend(before), *shift)
