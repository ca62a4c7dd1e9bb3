"""Bodies: pedestrians, two-wheelers and vehicles from the side, rear and front by day, at night and in fog.

    python docs/experiments/bodies.py docs/bodies.png

The camera reads road users of any highway-env road by the name of their class: "Pedestrian", "Bicycle" and
"Motorcycle" have bodies of their own, and the body of a vehicle follows from its size.
"""

import math
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from highway_env.road.lane import LineType, StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import Obstacle

from lgmd_gym.camera import EgoCamera
from lgmd_gym.camera.objects import BODY_MODELS, body_of
from lgmd_gym.envs.families.scenario import ADULT_SIZE, BICYCLE_SIZE, CHILD_SIZE, MOTORCYCLE_SIZE
from lgmd_gym.plotting.figures import contact_sheet


class Pedestrian(Obstacle):
    """A pedestrian."""


class Bicycle(Obstacle):
    """A bicycle with its rider."""


class Motorcycle(Obstacle):
    """A motorcycle with its rider."""


WORLD = 42
LIGHTS = {
    "day": {"world": WORLD},
    "night": {"world": WORLD, "weather": "night"},
    "fog": {"world": WORLD, "weather": "fog"},
}
HEADINGS = {"side": math.pi / 2, "rear": 0.0, "front": math.pi}
FIGURES = {
    "adult": (Pedestrian, ADULT_SIZE, 1.4),
    "child": (Pedestrian, CHILD_SIZE, 1.4),
    "bicycle": (Bicycle, BICYCLE_SIZE, 4.2),
    "motorcycle": (Motorcycle, MOTORCYCLE_SIZE, 12.5),
}
"""Class, size [m] and speed [m/s] of each figure."""
VEHICLES = {
    "small": (3.8, 1.7), "saloon": (4.6, 1.8), "suv": (4.6, 1.9), "van": (5.9, 2.0), "truck": (8.5, 2.5),
    "trailer": (16.5, 2.55), "bus": (12.0, 2.55),
}  # fmt: skip
"""Length and width of each vehicle [m]."""


def empty_road() -> Road:
    """Return a straight road with one lane."""
    network = RoadNetwork()
    lines = [LineType.CONTINUOUS_LINE, LineType.CONTINUOUS_LINE]
    network.add_lane("a", "b", StraightLane([-100, 0], [500, 0], width=3.5, line_types=lines))
    return Road(network, np_random=np.random.RandomState(0))


def add_body(road: Road, name: str, x: float, heading: float) -> None:
    """Add a body by its name."""
    if name in FIGURES:
        cls, size, speed = FIGURES[name]
        body = cls(road, [x, 0.0], heading, speed)
        body.travelled, body.shade = 0.45, 70
        body.LENGTH, body.WIDTH, body.HEIGHT = size
        road.objects.append(body)
        return
    body = Vehicle(road, [x, 0.0], heading, 10.0)
    body.LENGTH, body.WIDTH = VEHICLES[name]
    model, low, high = BODY_MODELS[name]
    body.HEIGHT = 0.5 * (low + high)
    # The world chooses the body of a vehicle by its shade.
    shades = [
        shade for shade in range(80, 256) if body_of(WORLD, 16 * shade, *VEHICLES[name], 0.0)[0] == model
    ]
    body.shade = shades[len(shades) // 3]
    road.vehicles.append(body)


def picture(name: str, heading: float, light: dict[str, object]) -> np.ndarray:
    """Return a frame that a body fills, seen from an ego behind it."""
    length, _, height = FIGURES[name][1] if name in FIGURES else (*VEHICLES[name], BODY_MODELS[name].highest)
    away = max(1.6 * length, 2.6 * height) + 0.5 * length
    pitch = math.degrees(math.atan2(0.5 * height - 1.2, away))
    road = empty_road()
    ego = Vehicle(road, [0.0, 0.0], 0.0, 10.0)
    road.vehicles.append(ego)
    add_body(road, name, away + 0.5 * ego.LENGTH - 1.7, heading)
    env = SimpleNamespace(road=road, vehicle=ego, steps=0, config={"simulation_frequency": 30})
    camera = {"shape": [84, 112], "hfov_deg": 42.0, "mount": {"pitch_deg": pitch}}
    return EgoCamera(camera, {"roadside": 0.0, **light}).render(env)


def main(path: str | Path = "docs/bodies.png", quick: bool = False) -> dict[str, dict[str, np.ndarray]]:
    """Save the sheet and return its frames; `quick` limits it to two bodies by day."""
    names = [*FIGURES, *VEHICLES][3:5] if quick else [*FIGURES, *VEHICLES]
    lights = {"day": LIGHTS["day"]} if quick else LIGHTS
    sheet = {
        name: {
            f"{light}, {view}": picture(name, heading, fields)
            for light, fields in lights.items()
            for view, heading in HEADINGS.items()
        }
        for name in names
    }
    contact_sheet(Path(path), sheet)
    print(f"{len(sheet)} bodies under {len(lights)} lights: {path}")
    return sheet


if __name__ == "__main__":
    main(*sys.argv[1:2])
