"""Overlays on the camera frame: the danger zone, and boxes around bodies ahead."""

from collections.abc import Iterable
from math import cos, hypot, sin
from typing import Any

import numpy as np

from lgmd_gym.camera import EgoCamera
from lgmd_gym.errors import check_items, check_keys

OVERLAYS = ("zone", "targets")
ZONE_WIDTH = 3.5  # [m], as by default in `lgmd_gym.neuron.danger_zone`
ZONE_REACH = (2.0, 150.0)  # [m] ahead of the ego's centre
TARGET_RANGE = 120.0  # [m]
DEFAULT_HEIGHT = 1.5  # [m], of bodies without a height


def checked_overlays(names: Iterable[str]) -> tuple[str, ...]:
    """Return names of overlays as a tuple; raise ValueError for an unknown name."""
    names = check_items("overlays", names, str, "names")
    check_keys("overlay", names, OVERLAYS)
    return names


def danger_zone_edges(camera: EgoCamera, ego: Any) -> list[np.ndarray]:
    """Return the left and right edge of the danger zone in pixels of the last frame.

    The zone is that of `lgmd_gym.neuron.danger_zone` with its default width, for the focal length, mount and
    pitch of the camera.

    Args:
        camera: The camera, after its first frame.
        ego: The ego vehicle.

    Returns:
        Two arrays of points (u, v), float64, shape (points, 2), without points behind the camera.
    """
    ahead = np.geomspace(*ZONE_REACH, 40)
    heading = float(ego.heading)
    edges = []
    for side in (-0.5 * ZONE_WIDTH, 0.5 * ZONE_WIDTH):
        x = ego.position[0] + ahead * cos(heading) - side * sin(heading)
        y = ego.position[1] + ahead * sin(heading) + side * cos(heading)
        points = camera.project(np.stack([x, y, np.zeros_like(x)], axis=-1))
        edges.append(points[np.isfinite(points).all(axis=1)])
    return edges


def target_boxes(camera: EgoCamera, env: Any) -> list[tuple[float, float, float, float]]:
    """Return the bounding boxes of solid bodies ahead, nearest first.

    Args:
        camera: The camera, after its first frame.
        env: The unwrapped highway-env environment.

    Returns:
        Boxes (left, top, right, bottom) in pixels of the last frame, each at least partly inside it.
    """
    ego, road = env.vehicle, env.road
    height, width = camera.shape
    boxes = []
    for body in (*road.vehicles, *road.objects):
        if body is ego or not getattr(body, "solid", True):
            continue
        distance = hypot(body.position[0] - ego.position[0], body.position[1] - ego.position[1])
        if distance >= TARGET_RANGE:
            continue
        corners = camera.project(_corners(body))
        if not np.isfinite(corners).all():
            continue
        left, top = corners.min(axis=0)
        right, bottom = corners.max(axis=0)
        if right > 0.0 and left < width and bottom > 0.0 and top < height:
            boxes.append((distance, (float(left), float(top), float(right), float(bottom))))
    return [box for _, box in sorted(boxes)]


def _corners(body: Any) -> np.ndarray:
    """Return the eight corners of a body, float64, shape (8, 3) [m]."""
    c, s = cos(float(body.heading)), sin(float(body.heading))
    x, y = body.position
    return np.array(
        [
            (x + a * c - b * s, y + a * s + b * c, z)
            for a in (-body.LENGTH / 2, body.LENGTH / 2)
            for b in (-body.WIDTH / 2, body.WIDTH / 2)
            for z in (0.0, getattr(body, "HEIGHT", DEFAULT_HEIGHT))
        ]
    )
