"""What is drawn over the eye's frame: the danger zone, and boxes around who is ahead."""

from math import cos, hypot, sin
from typing import Any

import numpy as np

from lgmd_gym.errors import check_keys

OVERLAYS = ("zone", "targets")
ZONE_WIDTH = 3.5  # [m], the default lane of `lgmd_gym.neuron.danger_zone`
ZONE_REACH = (2.0, 150.0)  # [m] ahead of the ego's centre
TARGET_RANGE = 120.0  # [m]
CAR_HEIGHT = 1.5  # [m], of cars that do not say


def check_overlays(names: Any) -> tuple[str, ...]:
    """Return the names of overlays as a tuple, or raise ValueError that names the nearest."""
    names = tuple(names)
    check_keys("overlay", names, OVERLAYS)
    return names


def danger_lines(camera: Any, ego: Any) -> list[np.ndarray]:
    """Return the two edges of the lane straight ahead, in pixels of the last frame.

    The lane is that of `lgmd_gym.neuron.danger_zone` with its default width, seen through whatever lens,
    mount and pitch the camera has.

    Args:
        camera: An `EgoCamera` that has rendered.
        ego: The car that carries it.

    Returns:
        Two arrays of points (u, v), float64, shape (points, 2); what lies behind the lens is left out.
    """
    ahead = np.geomspace(*ZONE_REACH, 40)
    heading = float(ego.heading)
    edges = []
    for side in (-0.5 * ZONE_WIDTH, 0.5 * ZONE_WIDTH):
        x = ego.position[0] + ahead * cos(heading) - side * sin(heading)
        y = ego.position[1] + ahead * sin(heading) + side * cos(heading)
        seen = camera.project(np.stack([x, y, np.zeros_like(x)], axis=-1))
        edges.append(seen[np.isfinite(seen).all(axis=1)])
    return edges


def target_boxes(camera: Any, host: Any) -> list[tuple[float, float, float, float]]:
    """Return the outlines of the solid things ahead, nearest first.

    Args:
        camera: An `EgoCamera` that has rendered.
        host: The highway-env environment.

    Returns:
        Boxes (left, top, right, bottom) in pixels of the last frame, all with a part inside it.
    """
    ego, road = host.vehicle, host.road
    height, width = camera.shape
    found = []
    for item in (*road.vehicles, *road.objects):
        if item is ego or not getattr(item, "solid", True):
            continue
        away = hypot(item.position[0] - ego.position[0], item.position[1] - ego.position[1])
        seen = camera.project(_corners(item)) if away < TARGET_RANGE else np.full((1, 2), np.nan)
        if not np.isfinite(seen).all():
            continue
        left, top = seen.min(axis=0)
        right, bottom = seen.max(axis=0)
        if right > 0.0 and left < width and bottom > 0.0 and top < height:
            found.append((away, (float(left), float(top), float(right), float(bottom))))
    return [box for _, box in sorted(found)]


def _corners(item: Any) -> np.ndarray:
    """Return the eight corners of a body, float64, shape (8, 3) [m]."""
    heading = float(item.heading)
    along, across = item.LENGTH / 2, item.WIDTH / 2
    tall = getattr(item, "HEIGHT", CAR_HEIGHT)
    return np.array(
        [
            (
                item.position[0] + a * cos(heading) - b * sin(heading),
                item.position[1] + a * sin(heading) + b * cos(heading),
                z,
            )
            for a in (-along, along)
            for b in (-across, across)
            for z in (0.0, tall)
        ]
    )
