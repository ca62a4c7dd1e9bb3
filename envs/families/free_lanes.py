"""Lanes of a road that no one uses in a scenario."""

from math import cos, sin

from lgmd_gym.envs.families.scenario import LANE_WIDTH, Actor, Scenario


def free_lane(scenario: Scenario) -> int | None:
    """Return the index of a lane next to the ego's that no actor uses; None without one.

    The right lane comes first. Only straight roads with lanes in one direction are considered, and only
    scenarios in which the ego and the other solid actors drive straight on.
    """
    road, solid = scenario.road, [actor for actor in scenario.actors if actor.kind != "road_marking"]
    if road.kind != "straight" or scenario.ego_path or any(map(_leaves_lane, solid)):
        return None
    for lane in (road.ego_lane + 1, road.ego_lane - 1):
        offset = (road.ego_lane - lane) * LANE_WIDTH
        if 0 <= lane < road.lanes and not any(_reaches(actor, offset) for actor in solid):
            return lane
    return None


def _leaves_lane(actor: Actor) -> bool:
    return bool(actor.path) or (actor.speed > 0.0 and abs(sin(actor.heading)) > 1e-9)


def _reaches(actor: Actor, offset: float) -> bool:
    """Return whether an actor reaches into the lane with a lateral offset from the ego's [m]."""
    half = 0.5 * (actor.width * abs(cos(actor.heading)) + actor.length * abs(sin(actor.heading)))
    return abs(actor.lateral_offset - offset) < 0.5 * LANE_WIDTH + half
