"""Straight roads with an ego car, as environments for the camera."""

from types import SimpleNamespace

import numpy as np
from highway_env.road.lane import CircularLane, LineType, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Landmark, Obstacle

from lgmd_gym.camera import road_geometry
from lgmd_gym.camera.objects import MODEL_BOX, OBJECT
from lgmd_gym.camera.road_pool import road_key
from lgmd_gym.camera.roadside import PLANT_RANGE

EGO_LENGTH = 4.3
CAR_SIZE = (4.023, 1.712, 1.427)
"""Length, width and height of the default car [m]."""


def env_of(road, ego, steps=0):
    """Return a stand-in for an environment with this road and ego."""
    ego.LENGTH = EGO_LENGTH
    road.vehicles.append(ego)
    env = SimpleNamespace(road=road, vehicle=ego, steps=steps, config={"simulation_frequency": 30})
    env.unwrapped = env
    return env


def straight_env(lanes=3, width=3.5, heading=0.0, x=0.0, y=None, speed=13.89, line_types=True):
    """Return a straight road along +x with the ego in its middle lane."""
    net = RoadNetwork()
    solid, striped, none = LineType.CONTINUOUS_LINE, LineType.STRIPED, LineType.NONE
    for i in range(lanes):
        lines = [solid if i == 0 else striped, solid if i == lanes - 1 else none]
        lines = lines if line_types else [none, none]
        lane = StraightLane([-200, i * width], [5000, i * width], width=width, line_types=lines)
        net.add_lane("a", "b", lane)
    road = Road(net, np_random=np.random.RandomState(0))
    return env_of(road, Vehicle(road, [x, width * (lanes // 2) if y is None else y], heading, speed))


def ring_road(kind=LineType.CONTINUOUS, clockwise=True):
    """Return a ring of 40 m radius with one lane 4 m wide, and the lane."""
    net = RoadNetwork()
    phases = (0.0, 2 * np.pi) if clockwise else (2 * np.pi, 0.0)
    kinds = [kind, LineType.NONE]
    lane = CircularLane([0, 0], 40.0, *phases, clockwise=clockwise, width=4.0, line_types=kinds)
    net.add_lane("a", "b", lane)
    return Road(net, np_random=np.random.RandomState(0)), lane


def add_car(env, x, y, shade=None, heading=0.0, size=CAR_SIZE, speed=0.0):
    """Add a vehicle to the road."""
    car = Vehicle(env.road, [x, y], heading, speed)
    car.LENGTH, car.WIDTH, car.HEIGHT = size
    if shade is not None:
        car.shade = shade
    env.road.vehicles.append(car)
    return car


def add_mark(env, x, y, shade=None, size=(2.0, 2.0)):
    """Add a landmark, flat on the ground."""
    mark = Landmark(env.road, [x, y])
    mark.LENGTH, mark.WIDTH = size
    if shade is not None:
        mark.shade = shade
    env.road.objects.append(mark)
    return mark


def add_obstacle(env, x, y, shade=None):
    """Add an obstacle."""
    obstacle = Obstacle(env.road, [x, y])
    if shade is not None:
        obstacle.shade = shade
    env.road.objects.append(obstacle)
    return obstacle


FIGURES = {
    kind: (type(kind, (Obstacle,), {}), size)
    for kind, size in (
        ("Pedestrian", (0.6, 0.5, 1.8)),
        ("Bicycle", (1.89, 0.5, 1.86)),
        ("Motorcycle", (2.08, 0.79, 1.45)),
    )
}
"""Classes of figures by name, as the camera reads them, and their usual sizes."""


def add_figure(env, kind, x, y, shade=None, heading=0.0, size=None, speed=0.0, travelled=0.0):
    """Add a "Pedestrian", "Bicycle" or "Motorcycle" of length, width and height."""
    cls, usual = FIGURES[kind]
    figure = cls(env.road, [x, y], heading, speed)
    figure.LENGTH, figure.WIDTH, figure.HEIGHT = usual if size is None else size
    figure.travelled = travelled
    if shade is not None:
        figure.shade = shade
    env.road.objects.append(figure)
    return figure


def lens_x(env):
    """World x of the default lens of an ego that heads along +x."""
    return env.vehicle.position[0] + EGO_LENGTH / 2 - 1.7


def set_roadside(env, params, roadside):
    """Set what cameras with these parameters draw along a road: `OBJECT` records, sorted by x."""
    key = road_key(params.scene)
    geometry = road_geometry.road_geometry(env.road, *key)
    order = np.argsort(roadside["x"], kind="stable")
    road_geometry._CACHE[env.road.network][key] = geometry._replace(roadside=roadside[order])


def box_record(x, y, size, heading=0.0, shade=150.0, **fields):
    """Return an `OBJECT` record of a plain box of length, width and height; other fields by name."""
    out = np.zeros(1, OBJECT)
    values = {"model": MODEL_BOX, "range": PLANT_RANGE, "cos": np.cos(heading), "sin": np.sin(heading)}
    values |= {"x": x, "y": y, "shade": shade, "length": size[0], "width": size[1], "height": size[2]}
    for name, value in (values | fields).items():
        out[name] = value
    return out
