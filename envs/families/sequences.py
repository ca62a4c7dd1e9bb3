"""Threats that go away, followed by a second one."""

from math import sqrt
from typing import Annotated

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.script import Bend, Segment, lane_change
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.arguments import EgoSpeed, Headway, LeadShade, between, draw, kmh, one_of, within
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.road_users import ADULT, RunUp, crossing_actor
from lgmd_gym.envs.families.scenario import LANE_WIDTH, START_TTC, Actor, RoadPlan, Scenario

FIRST = ("car", "pedestrian")
BRAKES_AT = 3.5  # [s] after which the car brakes
KEPT = 0.4  # of its speed that the car keeps
LEAVES_AFTER = 0.5  # [s] from the contact without braking to the lane change
CHANGE_TIME, REGAIN = 3.0, 2.0  # [s] of the lane change; [m/s²] with which the car then regains its speed
SHORTEST_CHANGE = 10.0  # [m]
WALKING_SPEED = 2.0  # [m/s]
SLOW_END = 14.0  # [s] for an ego that regains its speed late


def _sequence(rng: np.random.Generator) -> Arguments:
    first = FIRST[int(rng.integers(len(FIRST)))]
    drawn = draw(
        ego_speed=kmh(40.0, 110.0) if first == "car" else kmh(25.0, 60.0),
        headway=between(0.8, 2.0),
        deceleration=between(3.0, 8.0),
        pause=between(3.0, 8.0),
    )
    return {"first": first} | drawn(rng)


@family("SecondThreat", Level("SecondThreat", 2.0, _sequence), threat=True)
def threat_after_threat(
    ego_speed: EgoSpeed = 80 * KMH,
    first: Annotated[
        str, one_of(FIRST, 'First threat: the "car" ahead brakes, or a "pedestrian" crosses')
    ] = "car",
    headway: Headway = 1.0,
    deceleration: Annotated[float, within("[2, 10]", "m/s²", "Deceleration of the car")] = 6.0,
    pause: Annotated[
        float,
        within(
            "[3, 20]",
            "s",
            "Time from the contact with the first threat to that with the second at the scripted speed",
        ),
    ] = 4.0,
    shade: LeadShade = None,
) -> Scenario:
    """A threat goes away by itself, and a car stands in the lane behind it.

    Without braking, the ego has contact with the first threat. The car brakes from 3.5 s on to 40 % of its
    speed, changes into the left lane within 3 s, from 0.5 s after that contact on, and regains its speed; the
    pedestrian walks on across the road at 2 m/s. An ego that brakes and then releases the brake must brake
    again for the standing car; one that keeps braking stops far from it. `headway` and `deceleration` belong
    to the car. It is not a case of a protocol, and there are no levels without its target, because two
    threats would have to go.
    """
    if first == "pedestrian":
        contact, road = START_TTC, RoadPlan(kind="two-way")
        motion = RunUp(WALKING_SPEED, (), contact * WALKING_SPEED)
        gone = crossing_actor(ADULT, ego_speed, "right", 0.5, motion, shade)
    else:
        contact, road = _contact_time(ego_speed, headway, deceleration), RoadPlan()
        gone = _leaving_car(ego_speed, headway, deceleration, contact, shade)
    second = Actor(gap=ego_speed * (contact + pause))
    return Scenario(
        family="SecondThreat",
        ego_speed=ego_speed,
        duration=contact + pause + SLOW_END,
        actors=(gone, second),
        road=road,
    )


def _contact_time(speed: float, headway: float, deceleration: float) -> float:
    """Return the time at which the ego touches the braking car at constant speed [s]."""
    gap, lost = headway * speed, (1.0 - KEPT) * speed
    closed = lost**2 / (2.0 * deceleration)  # [m] while the car brakes
    if gap <= closed:
        return BRAKES_AT + sqrt(2.0 * gap / deceleration)
    return BRAKES_AT + lost / deceleration + (gap - closed) / lost


def _leaving_car(
    speed: float, headway: float, deceleration: float, contact: float, shade: int | None
) -> Actor:
    """Return the car that brakes ahead of the ego and leaves the lane after the `contact` [s]."""
    slow = KEPT * speed
    slowed = BRAKES_AT + (speed - slow) / deceleration  # [s]
    leaving = max(contact, slowed) + LEAVES_AFTER
    straight = BRAKES_AT * speed + (slowed - BRAKES_AT) * (speed + slow) / 2 + (leaving - slowed) * slow
    change = max(CHANGE_TIME * slow, SHORTEST_CHANGE)  # [m]
    braking = Segment(start=BRAKES_AT, acceleration=-deceleration, final_speed=slow)
    accelerating = Segment(start=leaving + change / slow, acceleration=REGAIN, final_speed=speed)
    return Actor(
        gap=headway * speed,
        speed=speed,
        profile=(braking, accelerating),
        path=(Bend(straight), *lane_change(change, LANE_WIDTH)),
        shade=shade,
    )
