# pyright: standard
# Not strict: highway-env states few types.
"""Contents of the dashboard: the quantities of lamps and bars, and overlays on the camera frame."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import cos, hypot, inf, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.aliases import Info
from lgmd_gym.camera import EgoCamera
from lgmd_gym.errors import check_items, check_keys

if TYPE_CHECKING:
    from highway_env.vehicle.kinematics import Vehicle
    from highway_env.vehicle.objects import RoadObject


BRAKING_THRESHOLD = 0.1  # [m/s²], deceleration above which the brake lamp is lit


@dataclass(frozen=True, slots=True)
class DisplayState:
    """State of an episode after a decision; undefined values are infinite."""

    time: float  # time since the reset [s]
    speed: float  # ego speed [m/s]
    gap: float = inf  # free distance along the ego's path [m]
    ttc: float = inf  # time to contact [s]
    # ego deceleration, >= 0 [m/s²]; in environments of this package, only the part beyond the script
    deceleration: float = 0.0
    alert: bool = False  # whether the neuron, or the agent if it reports alerts, is in alert
    contact: bool = False  # whether the ego has had contact
    impact_speed: float = inf  # relative speed at contact [m/s]

    @property
    def braking(self) -> bool:
        """Whether the ego brakes."""
        return self.deceleration > BRAKING_THRESHOLD

    @classmethod
    def from_info(cls, env: Any, info: Info, alert: bool | None = None) -> "DisplayState":
        """Return the current state.

        Args:
            env: The unwrapped highway-env environment.
            info: Info of its last step. Quantities that it lacks, as in stock highway-env environments, are
                taken from the vehicle or stay undefined.
            alert: Alert of the agent; None for that of the neuron.
        """
        ego = env.vehicle
        action: dict[str, float] = getattr(ego, "action", None) or {}
        return cls(
            time=float(env.time),
            speed=float(info.get("ego_speed", ego.speed)),
            gap=float(info.get("gap", inf)),
            ttc=float(info.get("ttc", inf)),
            deceleration=float(info.get("deceleration", max(0.0, -float(action.get("acceleration", 0.0))))),
            alert=bool(info.get("lgmd/alert", False)) if alert is None else alert,
            contact=bool(info.get("collision", ego.crashed)),
            impact_speed=float(info.get("relative_impact_speed", inf)),
        )


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


def danger_zone_edges(camera: EgoCamera, ego: "Vehicle") -> list[np.ndarray]:
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
    edges: list[np.ndarray] = []
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
    boxes: list[tuple[float, tuple[float, float, float, float]]] = []
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


def _corners(body: "Vehicle | RoadObject") -> np.ndarray:
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
