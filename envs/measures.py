"""Ground truth about the ego and what is ahead of it: gap and time to contact."""

from math import cos, sin

from highway_env.vehicle.kinematics import Vehicle

from lgmd_gym.envs.contact import first_touch
from lgmd_gym.envs.undefined import UNDEFINED
from lgmd_gym.envs.vehicles import EgoCar, StraightCar

TTC_HORIZON = 10.0  # [s]
GAP_HORIZON = 300.0  # [m]


def others(ego: EgoCar, vehicles: list[Vehicle]) -> list[StraightCar]:
    """Return everybody but the ego."""
    return [vehicle for vehicle in vehicles if vehicle is not ego and isinstance(vehicle, StraightCar)]


def gap(ego: EgoCar, vehicles: list[Vehicle]) -> float:
    """Return the free distance along the ego's path, from its front bumper [m].

    The path is the ego's own width swept along its heading, against everybody where they are now. NaN if
    nothing is in it within 300 m.
    """
    dx, dy = GAP_HORIZON * cos(ego.heading), GAP_HORIZON * sin(ego.heading)
    touches = [first_touch(ego.rectangle, other.rectangle, dx, dy) for other in others(ego, vehicles)]
    return min((touch * GAP_HORIZON for touch in touches if touch is not None), default=UNDEFINED)


def time_to_contact(ego: EgoCar, vehicles: list[Vehicle]) -> float:
    """Return the first time the ego touches anybody if all keep speed and heading [s].

    Euro NCAP AEB C2C v4.3.1, 2.1. NaN if there is no touch within 10 s.
    """
    ego_x, ego_y = ego.speed * cos(ego.heading), ego.speed * sin(ego.heading)
    times = []
    for other in others(ego, vehicles):
        dx = TTC_HORIZON * (ego_x - other.speed * cos(other.heading))
        dy = TTC_HORIZON * (ego_y - other.speed * sin(other.heading))
        touch = first_touch(ego.rectangle, other.rectangle, dx, dy)
        if touch is not None:
            times.append(touch * TTC_HORIZON)
    return min(times, default=UNDEFINED)
