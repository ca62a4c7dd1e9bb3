"""Cars in adjacent and oncoming lanes, lane changes, and head-on threats: CCFhos and CCFhol."""

from collections.abc import Callable
from math import pi
from typing import Annotated

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.script import Bend, Pose, Segment, lane_change
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.arguments import (
    EITHER,
    FAST_KMH,
    ChangeLength,
    EgoSpeed,
    Headway,
    OtherShade,
    Sampler,
    Shade,
    always,
    between,
    draw,
    fast,
    grey,
    kmh,
    maybe,
    one,
    slower,
    speed,
    truth,
    within,
)
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import LARGE_CAR, RunUp, yielding
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


def _slower_beside(rng: np.random.Generator) -> Arguments:
    ego_speed = kmh(50.0, 130.0)(rng)
    offset = between(3.0, 3.7)(rng) * one(1.0, -1.0)(rng)
    return {
        "ego_speed": ego_speed,
        "target_speed": ego_speed - kmh(5.0, 40.0)(rng),
        "lateral_offset": offset,
    }


@family(
    "AdjacentPass",
    Level("AdjacentPass", 1.0, _queue),
    Level("FastAdjacentPass", 0.3, fast(_queue)),
    Level("AdjacentSlower", 1.0, _slower_beside),
)
def pass_standing(
    ego_speed: EgoSpeed = 50 * KMH,
    lateral_offset: Annotated[
        float,
        within(
            "[-20, 20]",
            "m",
            "Centreline of the other cars minus ego centreline, + left; far enough to avoid contact",
        ),
    ] = LANE_WIDTH,
    cars: Annotated[int, whole(None, "[1, 20]", doc="Number of cars in the queue")] = 1,
    target_speed: Annotated[float, slower("Speed of the other cars", zero=True)] = 0.0,
    shade: Annotated[int | None, grey("the other cars")] = None,
) -> Scenario:
    """The ego passes a stationary or slower car, or a queue of cars, in the adjacent lane; not a threat."""
    if target_speed >= ego_speed:
        raise ValueError(f"target_speed must be below ego_speed {ego_speed:g} m/s, got {target_speed:g}")
    closing_speed = ego_speed - target_speed
    if abs(lateral_offset) <= CONTACT_OFFSET:
        raise ValueError(
            f"lateral_offset must exceed {CONTACT_OFFSET:g} m to either side in AdjacentPass, "
            f"got {shown(lateral_offset)}; for a car in the ego's path use CCRs"
        )
    pitch = TARGET_LENGTH + QUEUE_SPACING
    queue = tuple(
        Actor(
            gap=START_TTC * closing_speed + number * pitch,
            lateral_offset=lateral_offset,
            speed=target_speed,
            shade=shade,
        )
        for number in range(cars)
    )
    length = START_TTC * closing_speed + cars * pitch + EGO_LENGTH
    duration = length / closing_speed + AFTER_PASSING
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
    Level(
        "RollingCar",
        2.0,
        draw(
            ego_speed=kmh(),
            target_speed=between(0.5, 5.0),
            impact_location=between(0.0, 1.0),
            yields=always,
        ),
        twin=True,
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
    yields: Annotated[
        bool,
        truth(
            "Whether the target brakes evenly, from 1 s before the contact without braking, to rest 1 s "
            "after it"
        ),
    ] = False,
    shade: Shade = None,
) -> Scenario:
    """An oncoming car drives in the ego's lane (Car-to-Car Front Head-on straight).

    Braking lowers the ego's speed at the contact but does not avoid it, unless the target yields: a car that
    rolls towards the ego, and whose driver notices it late. The episode continues at the ego's standstill.
    Sources: Euro NCAP AEB Car-to-Car v4.3.1; Frontal Collisions v1.1; `yields` is not a case of a protocol.
    """
    motion = yielding(target_speed) if yields else RunUp(target_speed, (), START_TTC * target_speed)
    target = Actor(
        gap=START_TTC * ego_speed + motion.distance,
        lateral_offset=(impact_location - 0.5) * EGO_WIDTH,
        heading=pi,
        speed=target_speed,
        profile=motion.profile,
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


def _cut_in_slower(
    rng: np.random.Generator, slower_by: Sampler, end_ttc: Callable[[float], Arguments]
) -> Arguments:
    """Draw a car that cuts in and is slower than the ego, in a lane change of 2.5 to 5 s.

    Args:
        rng: Random generator.
        slower_by: Sampler of the ego speed minus that of the other car [m/s].
        end_ttc: Returns the arguments after the lane change for a difference of the speeds.
    """
    ego_speed = kmh(30.0, FAST_KMH[1])(rng)
    excess = -min(slower_by(rng), ego_speed - 10.0 * KMH)
    length = (ego_speed + excess) * between(2.5, 5.0)(rng)
    return {
        "ego_speed": ego_speed,
        "excess": excess,
        "change_length": max(length, 10.0),
        "left": EITHER(rng),
        **end_ttc(-excess),
    }


def _threatening(rng: np.random.Generator) -> Arguments:
    return _cut_in_slower(rng, kmh(5.0, 40.0), lambda _: {"end_ttc": between(0.8, 3.0)(rng)})


def _recovering(rng: np.random.Generator) -> Arguments:
    """Draw a car that regains the ego's speed within 15 to 45 % of the distance."""

    def after(closing_speed: float) -> Arguments:
        recovery, share = between(1.5, 3.5)(rng), between(0.15, 0.45)(rng)
        end_ttc = closing_speed / (2.0 * share * recovery)
        return {"end_ttc": min(max(end_ttc, 0.5), 10.0), "recovery": recovery}

    return _cut_in_slower(rng, kmh(5.0, 25.0), after)


@family(
    "CutIn",
    Level("CutIn", 1.0, draw(ego_speed=kmh(30.0), gap=between(10.0, 25.0))),
    Level("CutInThreat", 4.0, _threatening, threat=True, twin=True),
    Level("CutInRecovers", 1.0, _recovering),
)
def cut_in(
    ego_speed: EgoSpeed = 50 * KMH,
    gap: Annotated[
        float | None,
        maybe(
            "[2, 200]",
            "m",
            "Bumper-to-bumper distance at the start of the lane change; 12 m without `gap` and `end_ttc`",
        ),
    ] = None,
    excess: Annotated[
        float,
        within("[-40, 40]", "m/s", "Speed of the other car minus ego speed; not between -0.5 and 0"),
    ] = 5 * KMH,
    change_length: ChangeLength = 44.0,
    end_ttc: Annotated[
        float | None,
        maybe("[0.3, 10]", "s", "Alternative to `gap`: time to contact at the end of the lane change"),
    ] = None,
    recovery: Annotated[
        float,
        within("[0, 12]", "m/s²", "Acceleration to the ego's speed after the lane change; 0 for none"),
    ] = 0.0,
    left: Annotated[bool, truth("Whether the car comes from the left lane; otherwise from the right")] = True,
    shade: OtherShade = None,
) -> Scenario:
    """A car changes from an adjacent lane into the ego's lane; a threat only if it is slower than the ego.

    The lane change begins after 2 s. With a slower car it begins later if needed, so that the ego covers the
    gap at least 5 s after the start. With `gap`, a much slower car is passed before it reaches the ego's
    lane; with `end_ttc`, the contact is that time after the end of the lane change. A slower car that
    recovers is no threat if it regains the ego's speed within the distance: Δv² / (2 · recovery).
    """
    if -MIN_CLOSING < excess < 0.0:
        raise ValueError(f"excess must be >= 0 or <= -{MIN_CLOSING:g} m/s in CutIn, got {shown(excess)}")
    for name, given in (("end_ttc", end_ttc), ("recovery", recovery or None)):
        if excess >= 0.0 and given is not None:
            raise ValueError(f"{name} requires a slower car, got excess {excess:g} m/s; lower it below 0")
    if gap is not None and end_ttc is not None:
        raise ValueError(f"gap={shown(gap)} and end_ttc={shown(end_ttc)} both set the distance; pass one")
    target_speed = check_speed("ego_speed + excess", ego_speed + excess)
    aside = LANE_WIDTH if left else -LANE_WIDTH
    shift = lane_change(change_length, -aside)
    change = change_length / target_speed  # [s]
    if end_ttc is not None:
        gap = -end_ttc * excess + change * ego_speed - _covered_by(shift)
    elif gap is None:
        gap = 12.0
    before, duration = CHANGE_START, 9.0  # [s] in adjacent lanes; of the episode
    if excess < 0.0:
        closing = gap / -excess if end_ttc is None else change + end_ttc  # [s] from the start of the change
        before = max(CHANGE_START, START_TTC - closing)
        duration = before + closing + AFTERMATH
    recovering = ()
    if recovery > 0.0:
        recovering = (Segment(start=before + change, acceleration=recovery, final_speed=ego_speed),)
    other = Actor(
        gap=gap - before * excess,
        lateral_offset=aside,
        speed=target_speed,
        profile=recovering,
        path=(Bend(before * target_speed), *shift),
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


def _covered_by(shift: tuple[Bend, ...]) -> float:
    """Return the distance along the road that a lane change covers [m], less than its length."""
    # A module that loads numba; the registration of the scenario families must not.
    from lgmd_gym.envs.dynamics.path import Path

    return Path(Pose(0.0, 0.0, 0.0), shift).pose(sum(bend.length for bend in shift)).x


def _on_two_way_road(name: str, ego_speed: float, duration: float, *actors: Actor) -> Scenario:
    road = RoadPlan(kind="two-way")
    return Scenario(family=name, ego_speed=ego_speed, duration=duration, actors=actors, road=road)
