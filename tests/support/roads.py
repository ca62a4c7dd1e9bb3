"""Roads and stand-ins for environments that the camera's tests share (no tests here)."""

from types import SimpleNamespace

import numpy as np
from highway_env.road.lane import LineType, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle

EGO_LENGTH = 4.3


def straight_env(lanes=3, width=3.5, heading=0.0, x=0.0, y=None, speed=13.89, line_types=True):
    """A straight road along +x with the ego in its middle lane; no simulation needed."""
    net = RoadNetwork()
    solid, striped, none = LineType.CONTINUOUS_LINE, LineType.STRIPED, LineType.NONE
    for i in range(lanes):
        lines = [solid if i == 0 else striped, solid if i == lanes - 1 else none]
        lines = lines if line_types else [none, none]
        lane = StraightLane([-200, i * width], [5000, i * width], width=width, line_types=lines)
        net.add_lane("a", "b", lane)
    road = Road(net, np_random=np.random.RandomState(0))
    ego = Vehicle(road, [x, width * (lanes // 2) if y is None else y], heading, speed)
    ego.LENGTH = EGO_LENGTH
    road.vehicles.append(ego)
    env = SimpleNamespace(road=road, vehicle=ego)
    env.unwrapped = env
    return env


def add_car(env, x, y, shade=None, heading=0.0, size=(4.023, 1.712, 1.427), cls=Vehicle):
    """Put a standing vehicle on the road."""
    car = cls(env.road, [x, y], heading, 0.0)
    car.LENGTH, car.WIDTH, car.HEIGHT = size
    if shade is not None:
        car.shade = shade
    env.road.vehicles.append(car)
    return car


def lens_x(env):
    """World x of the default lens of an ego heading along +x."""
    return env.vehicle.position[0] + EGO_LENGTH / 2 - 1.7
