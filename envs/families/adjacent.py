"""Cars in adjacent and oncoming lanes, lane changes, and head-on threats: CCFhos and CCFhol."""

from math import pi
from typing import Annotated

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.script import Bend, Pose, lane_change
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.arguments import (
    EITHER,
    FAST_KMH,
    ChangeLength,
    EgoSpeed,
    Headway,
    OtherShade,
    Shade,
    between,
    draw,
    fast,
    grey,
    kmh,
    maybe,
    one,
    speed,
    truth,
    within,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import LARGE_CAR
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
from lgmd_gym.errors import shown
from lgmd_gym.fields import optional, whole

CONTACT_OFFSET = (EGO_WIDTH + TARGET_WIDTH) / 2  # [m], lateral offset up to which the cars touch
QUEUE_SPACING = 2.0  # [m] between the cars of a queue
AFTER_PASSING = 2.0  # [s] of driving after the last car
CHANGE_START = 2.0  # [s] after which a car that cuts in leaves its lane
MIN_CLOSING = 0.5  # [m/s], slowest approach to a car that cuts in; slower ones take minutes
LAST_STRAIGHT = 1.5  # [s] before the contact, at which the lane change of CCFhol ends
TOP_KMH = 140.0  # of cars that overtake on a motorway, in random levels


def _queue(rng: np.random.Generator) -> Arguments:
    offset = between(3.0, 3.7)(rng) * one(1.0, -1.0)(rng)
    return {"ego_speed": kmh()(rng), "lateral_offset": offset, "cars": int(rng.integers(1, 7))}


@family("AdjacentPass", Level("AdjacentPass", 1.0, _queue), Level("FastAdjacentPass", 0.3, fast(_queue)))
def pass_standing(
    ego_speed: EgoSpeed = 50 * KMH,
    lateral_offset: Annotated[
        float,
        within(
            "[-20, 20]",
            "m",
            "Centreline of the stationary cars minus ego centreline, + left; far enough to avoid contact",
        ),
    ] = LANE_WIDTH,
    cars: Annotated[int, whole(None, "[1, 20]", doc="Number of stationary cars in the queue")] = 1,
    shade: Annotated[int | None, grey("the stationary cars")] = None,
) -> Scenario:
    """The ego passes a stationary car or a queue of cars in the adjacent lane; not a threat."""
    if abs(lateral_offset) <= CONTACT_OFFSET:
        raise ValueError(
            f"lateral_offset must exceed {CONTACT_OFFSET:g} m to either side in AdjacentPass, "
            f"got {shown(lateral_offset)}; for a car in the ego's path use CCRs"
        )
    pitch = TARGET_LENGTH + QUEUE_SPACING
    queue = tuple(
        Actor(gap=START_TTC * ego_speed + number * pitch, lateral_offset=lateral_offset, shade=shade)
        for number in range(cars)
    )
    length = START_TTC * ego_speed + cars * pitch + EGO_LENGTH
    duration = length / ego_speed + AFTER_PASSING
    return Scenario(family="AdjacentPass", ego_speed=ego_speed, duration=duration, actors=queue)


@family("PassBetween", Level("PassBetween", 1.0, draw(ego_speed=kmh(30.0), inner_gap=between(4.0, 5.0))))
def pass_between(
    ego_speed: EgoSpeed = 80 * KMH,
    wheel_gap: Annotated[
        float | None,
        maybe(
            "[2, 10]",
            "m",
            "Distance between the facing outer sides of the parked cars' closest front tyres; 4.5 m "
            "without `wheel_gap` and `inner_gap`",
        ),
    ] = None,
    inner_gap: Annotated[
        float | None, maybe("[2, 10]", "m", "Distance between the inner sides of the parked cars")
    ] = None,
    shade: Annotated[int | None, grey("the parked cars")] = None,
) -> Scenario:
    """The ego drives between two parked cars with aligned rears; not a threat.

    Source: 49 CFR 571.127 S9.3.1 at 80 km/h, with 4.5 m between the closest front wheels of the parked cars;
    GB 39901-2025 at 60 km/h, with 4.5 m between their inner sides. At most one of both gaps can be given.
    """
    if inner_gap is None:
        aside = (4.5 if wheel_gap is None else wheel_gap) / 2 + (TARGET_TRACK + TYRE_WIDTH) / 2
    elif wheel_gap is not None:
        raise ValueError("wheel_gap and inner_gap cannot both be given in PassBetween; remove one")
    else:
        aside = inner_gap / 2 + TARGET_WIDTH / 2
    gap = max(START_TTC * ego_speed, 50.0)
    parked = tuple(Actor(gap=gap, lateral_offset=side * aside, shade=shade) for side in (1, -1))
    duration = (gap + TARGET_LENGTH + EGO_LENGTH) / ego_speed + AFTER_PASSING
    return Scenario(family="PassBetween", ego_speed=ego_speed, duration=duration, actors=parked)


def _overtaken_fast(rng: np.random.Generator) -> Arguments:
    ego_speed = kmh(*FAST_KMH)(rng)
    fastest = max(TOP_KMH * KMH - ego_speed, 11.0 * KMH)
    return {"ego_speed": ego_speed, "excess": between(10.0 * KMH, fastest)(rng)}


@family(
    "Overtaken",
    Level("Overtaken", 1.0, draw(ego_speed=kmh(30.0), excess=kmh(10.0, 40.0))),
    Level("FastOvertaken", 0.5, _overtaken_fast),
)
def being_overtaken(
    ego_speed: EgoSpeed = 80 * KMH,
    excess: Annotated[float, within("[0.1, 40]", "m/s", "Speed of the other car minus ego speed")] = 30 * KMH,
    shade: OtherShade = None,
) -> Scenario:
    """A faster car overtakes the ego in the left lane and enters the image from the side; not a threat."""
    faster = check_speed("ego_speed + excess", ego_speed + excess)
    behind = -(EGO_LENGTH + TARGET_LENGTH) - 3.0 * excess  # next to the ego after 3 s
    other = Actor(gap=behind, lateral_offset=LANE_WIDTH, speed=faster, shade=shade)
    return Scenario(family="Overtaken", ego_speed=ego_speed, duration=10.0, actors=(other,))


@family("Oncoming", Level("Oncoming", 1.0, draw(ego_speed=kmh(30.0), oncoming_speed=kmh(30.0))))
def meet_oncoming(
    ego_speed: EgoSpeed = 80 * KMH,
    oncoming_speed: Annotated[float, speed("Speed of the other car")] = 80 * KMH,
    shade: OtherShade = None,
) -> Scenario:
    """The ego meets an oncoming car in the adjacent lane of a two-way road; not a threat."""
    gap = START_TTC * (ego_speed + oncoming_speed)
    other = Actor(gap=gap, lateral_offset=LANE_WIDTH, heading=pi, speed=oncoming_speed, shade=shade)
    return _on_two_way_road("Oncoming", ego_speed, START_TTC + AFTER_PASSING, other)


@family(
    "CCFhos",
    Level(
        "CCFhos",
        3.0,
        draw(ego_speed=kmh(30.0), target_speed=kmh(30.0), impact_location=between(0.0, 1.0)),
    ),
    threat=True,
    twin=True,
)
def meet_in_lane(
    ego_speed: EgoSpeed = 50 * KMH,
    target_speed: Annotated[float, speed("Target speed")] = 50 * KMH,
    impact_location: Annotated[
        float,
        within(
            "[-0.25, 1.25]",
            "",
            "Position of the target's centre across the ego's width; 0 is the right side and 1 the left",
        ),
    ] = 0.5,
    shade: Shade = None,
) -> Scenario:
    """An oncoming car drives in the ego's lane (Car-to-Car Front Head-on straight).

    Braking lowers the ego's speed at the contact but does not avoid it: the target does not stop. The
    episode continues at the ego's standstill. Sources: Euro NCAP AEB Car-to-Car v4.3.1; Frontal Collisions
    v1.1.
    """
    target = Actor(
        gap=START_TTC * (ego_speed + target_speed),
        lateral_offset=(impact_location - 0.5) * EGO_WIDTH,
        heading=pi,
        speed=target_speed,
        shade=shade,
    )
    return _on_two_way_road("CCFhos", ego_speed, START_TTC + AFTERMATH, target)


def _lane_change(rng: np.random.Generator) -> Arguments:
    oncoming = kmh(40.0)(rng)
    return {
        "ego_speed": kmh(30.0)(rng),
        "target_speed": oncoming,
        "change_length": oncoming * between(2.7, 4.0)(rng),
        "following_distance": between(10.0, 25.0)(rng),
    }


@family("CCFhol", Level("CCFhol", 2.0, _lane_change), threat=True, twin=True)
def meet_overtaking(
    ego_speed: EgoSpeed = 50 * KMH,
    target_speed: Annotated[float | None, optional(speed("Target speed; None for that of the ego"))] = None,
    change_length: ChangeLength = 44.0,
    following_distance: Annotated[
        float, within("[1, 100]", "m", "Distance between the target and the car ahead of it")
    ] = 13.9,
    shade: Shade = None,
) -> Scenario:
    """An oncoming car overtakes another one into the ego's lane (Car-to-Car Front Head-on lane change).

    The lane change ends 1.5 s before the contact. As in CCFhos, braking does not avoid it. Source: Euro NCAP
    AEB Car-to-Car v4.3.1: 44 m and 13.9 m at 50 km/h, 60 m and 19.4 m at 70 km/h.
    """
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    oncoming = ego_speed if target_speed is None else target_speed
    shift = lane_change(change_length, LANE_WIDTH)
    way = sum(bend.length for bend in shift)
    contact = max(START_TTC, way / oncoming + LAST_STRAIGHT + 0.5)
    bends = (Bend((contact - LAST_STRAIGHT) * oncoming - way), *shift)
    gap = contact * ego_speed + Path(Pose(0.0, 0.0, 0.0), bends).pose(contact * oncoming).x
    target = Actor(gap=gap, lateral_offset=LANE_WIDTH, heading=pi, speed=oncoming, path=bends, shade=shade)
    overtaken = Actor(
        gap=gap - following_distance - LARGE_CAR.length,
        lateral_offset=LANE_WIDTH,
        heading=pi,
        speed=oncoming,
        **LARGE_CAR.fields,
    )
    return _on_two_way_road("CCFhol", ego_speed, contact + AFTERMATH, target, overtaken)


@family("CutIn", Level("CutIn", 1.0, draw(ego_speed=kmh(30.0), gap=between(10.0, 25.0))))
def cut_in(
    ego_speed: EgoSpeed = 50 * KMH,
    gap: Annotated[
        float, within("[2, 200]", "m", "Bumper-to-bumper distance at the start of the lane change")
    ] = 12.0,
    excess: Annotated[
        float,
        within("[-40, 40]", "m/s", "Speed of the other car minus ego speed; not between -0.5 and 0"),
    ] = 5 * KMH,
    change_length: ChangeLength = 44.0,
    shade: OtherShade = None,
) -> Scenario:
    """A car changes from the left lane into the ego's lane; a threat only if it is slower than the ego.

    The lane change begins after 2 s. With a slower car it begins later if needed, so that the ego covers the
    gap at least 5 s after the start. A much slower car is passed before it reaches the ego's lane.
    """
    if -MIN_CLOSING < excess < 0.0:
        raise ValueError(f"excess must be >= 0 or <= -{MIN_CLOSING:g} m/s in CutIn, got {shown(excess)}")
    target_speed = check_speed("ego_speed + excess", ego_speed + excess)
    before, duration = CHANGE_START, 9.0  # [s] in adjacent lanes; of the episode
    if excess < 0.0:
        closing = gap / -excess  # [s] from the start of the lane change
        before = max(CHANGE_START, START_TTC - closing)
        duration = before + closing + AFTERMATH
    other = Actor(
        gap=gap - before * excess,
        lateral_offset=LANE_WIDTH,
        speed=target_speed,
        path=(Bend(before * target_speed), *lane_change(change_length, -LANE_WIDTH)),
        shade=shade,
    )
    return Scenario(family="CutIn", ego_speed=ego_speed, duration=duration, actors=(other,))


@family("CutOut", Level("CutOut", 1.0, draw(ego_speed=kmh(30.0), headway=between(1.2, 2.5))))
def cut_out(
    ego_speed: Annotated[float, speed("Speed of both cars")] = 50 * KMH,
    headway: Headway = 1.5,
    change_length: ChangeLength = 44.0,
    shade: OtherShade = None,
) -> Scenario:
    """The lead car changes into the left lane and leaves a free road; not a threat."""
    lead = Actor(
        gap=ego_speed * headway,
        speed=ego_speed,
        path=(Bend(3.0 * ego_speed), *lane_change(change_length, LANE_WIDTH)),
        shade=shade,
    )
    return Scenario(family="CutOut", ego_speed=ego_speed, duration=9.0, actors=(lead,))


@family("LaneClosure", Level("LaneClosure", 1.0, draw(ego_speed=kmh(25.0, 55.0), left=EITHER)))
def change_lane_before_sign(
    ego_speed: Annotated[float, within(f"[{20 * KMH}, {60 * KMH}]", "m/s", "Ego speed; 20 to 60 km/h")] = 40
    * KMH,
    left: Annotated[bool, truth("Whether the ego changes to the left lane; otherwise to the right")] = True,
) -> Scenario:
    """The ego changes lane before a signboard that closes its lane; not a threat.

    The ego drives at constant speed and begins to steer 4.1 s before the sign. Source: UN R152 Rev.2, Annex 3
    Appendix 2, case 4, at 40 km/h.
    """
    steady = 4.0  # [s] before the ego steers
    onset = steady * ego_speed
    shift = lane_change(3.3 * ego_speed, LANE_WIDTH if left else -LANE_WIDTH)
    gap = onset + 4.1 * ego_speed
    sign = Actor(gap=gap, kind="box", shade=225, length=0.3, width=1.5, height=1.8)
    return Scenario(
        family="LaneClosure",
        ego_speed=ego_speed,
        duration=steady + 4.1 + 2.0,
        actors=(sign,),
        ego_path=(Bend(onset), *shift),
    )


def _on_two_way_road(name: str, ego_speed: float, duration: float, *actors: Actor) -> Scenario:
    road = RoadPlan(kind="two-way")
    return Scenario(family=name, ego_speed=ego_speed, duration=duration, actors=actors, road=road)
