"""RenderContext: cameras of one frame size that look at one scene and are drawn in one call."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.camera.effects import (
    LOOK_PAVED,
    beam_of,
    body_heave,
    body_pitch,
    clock_of,
    look_of,
    noise_offset,
    noise_table,
)
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import CAM_SIZE, Pose, camera_vector, mounted_pose
from lgmd_gym.camera.render.models import all_models
from lgmd_gym.camera.render.panorama import panorama_table
from lgmd_gym.camera.render.raster import draw_frames
from lgmd_gym.camera.render.sky import skyline
from lgmd_gym.camera.render.texture import ground_texture
from lgmd_gym.camera.scene import MAX_DRAWN, MAX_RANGE, OBJ_SIZE, ego_of, objects_into, road_geometry

_PATH_S = 1.0  # how far ahead in time the gaze "path" looks [s]
_PATH_MAX = math.radians(40.0)
_MOUNTS = 100.0  # no lens is farther than this from the ego's centre [m]


class Scene(NamedTuple):
    """An environment as it is now.

    Attributes:
        road: The Road.
        ego: The vehicle that carries the cameras.
        ticks: Simulation steps since the reset.
        time_s: Their time [s].
    """

    road: Any
    ego: Any
    ticks: int
    time_s: float


def scene_of(env: Any) -> Scene:
    """Read road, ego and clock of an environment.

    Raises:
        ValueError: If there is no road or ego yet, or the ego's pose is not finite.
    """
    road, ego = ego_of(env)
    x, y, heading = float(ego.position[0]), float(ego.position[1]), float(ego.heading)
    if not math.isfinite(x + y + heading):
        raise ValueError(f"the ego vehicle has position ({x}, {y}) and heading {heading}")
    return Scene(road, ego, *clock_of(env))


def shared_key(p: CameraParams) -> tuple[Any, ...]:
    """What cameras must have in common to share a stage."""
    common = (p.shape, p.seed, p.roadside, p.guard_rail, p.vehicles)
    # A panorama's table holds the light and the air, and no more detail than the lens resolves.
    return common if p.panorama == "skyline" else (*common, p.panorama, p.light, p.visibility_m, p.focal_px)


class RenderContext:
    """Buffers and tables for cameras of one `shared_key`.

    Args:
        cameras: Their parameters, at least one.

    Attributes:
        image: The last camera's light before the sensor, float32, shape (height, width) [grey levels].
        cams: Pose and optics of each camera at the end and at the start of the exposure, float64,
            shape (cameras, 2, 12).
    """

    def __init__(self, cameras: Sequence[CameraParams]) -> None:
        self.params = tuple(cameras)
        self._lenses = [(p, p.focal_px) for p in self.params]
        count, first = len(self.params), self.params[0]
        height, width = first.shape
        self.image = np.zeros((height, width), dtype=np.float32)
        self.cams = np.zeros((count, 2, CAM_SIZE))
        self._looks = np.stack([look_of(p) for p in self.params])
        centre = Pose(0.0, 0.0, 0.0, 0.0, 0.0)
        beams = [beam_of(camera_vector(centre, p.focal_px, p.shape), width) for p in self.params]
        self._views = (
            self._looks,
            np.stack(beams),  # low beam over the columns
            np.zeros((count, height, width), dtype=np.float32),  # skies
            np.full((count, 2), np.nan),  # yaw and pitch they were drawn for
            np.zeros(count, dtype=np.int64),  # where the noise starts
        )
        self._paved = False
        self._model = all_models()
        self._scratch = _scratch(height, width, len(self._model.corners_used))
        self._tables = (
            (*ground_texture("asphalt", first.seed), *ground_texture("verge", first.seed)),
            skyline(first.seed),
            noise_table(first.seed),
            panorama_table(first),
        )

    def aim(self, scene: Scene, gaze: tuple[float, float] | None = None) -> list[Pose]:
        """Point the cameras at a scene; returns their poses at the end of the exposure."""
        poses = []
        ego, time_s = scene.ego, scene.time_s
        x, y, heading = float(ego.position[0]), float(ego.position[1]), float(ego.heading)
        for k, (p, focal) in enumerate(self._lenses):
            pose = _pose(p, ego, (x, y, heading), gaze, time_s)
            self.cams[k, 0] = camera_vector(pose, focal, p.shape)
            poses.append(pose)
            if p.shutter_s > 0.0:
                before = _pose(p, ego, _earlier(ego, p.shutter_s), gaze, time_s - p.shutter_s)
                self.cams[k, 1] = camera_vector(before, focal, p.shape)
            if p.shot_noise > 0.0 or p.read_noise > 0.0:
                self._views[4][k] = noise_offset(p.seed, scene.ticks, pose.x, pose.y, pose.yaw)
        return poses

    def draw(self, out: np.ndarray, scene: Scene, objects: np.ndarray, count: int) -> None:
        """Draw the scene that the cameras are aimed at.

        Args:
            out: Frames, uint8, shape (cameras, height, width).
            scene: The scene.
            objects: Its objects, see `read_objects`; the roadside is appended to them.
            count: How many they are.
        """
        p = self.params[0]
        geometry = road_geometry(scene.road, p.roadside, p.seed, p.guard_rail)
        if geometry.paved != self._paved:
            self._paved = geometry.paved
            self._looks[:, LOOK_PAVED] = float(geometry.paved)
        draw_frames(
            out,
            self.image,
            self.cams,
            self._views,
            geometry[:3],
            self._tables,
            self._model,
            objects,
            count,
            self._scratch,
        )


def object_buffer() -> np.ndarray:
    """Return room for the objects of a scene, float64, shape (512, 12)."""
    return np.zeros((MAX_DRAWN, OBJ_SIZE))


def read_objects(out: np.ndarray, scene: Scene, p: CameraParams, poses: Sequence[Pose]) -> int:
    """Write all that lenses in these poses may see into `out`; returns how many objects that is."""
    x, y, _, yaw, _ = poses[0]
    boxes = p.vehicles == "box"
    if len(poses) == 1 or all(pose.x == x and pose.y == y and pose.yaw == yaw for pose in poses):
        look = (math.cos(yaw), math.sin(yaw))
        return objects_into(out, scene.road, scene.ego, x, y, look, p.seed, boxes)
    x, y = scene.ego.position
    reach = MAX_RANGE + _MOUNTS
    return objects_into(out, scene.road, scene.ego, x, y, (0.0, 0.0), p.seed, boxes, reach)


def _scratch(height: int, width: int, polygons: int) -> tuple[np.ndarray, ...]:
    return (
        np.zeros((height, width + 2, 3), dtype=np.float32),  # ground accumulator
        np.zeros((6, width + 2), dtype=np.float32),  # rows of the ground
        np.zeros((16, 3)),  # corners in camera axes
        np.zeros((5, 3)),  # axes of an object
        np.zeros((20, 2)),  # projected corners
        np.zeros((polygons, 2)),  # grey and light of polygons
        np.zeros(8),  # a quad on the ground
        np.zeros(MAX_DRAWN, dtype=np.int64),  # order
        np.zeros(MAX_DRAWN),  # distances
        np.zeros((height, width + 2, 2), dtype=np.float32),  # accumulator of the solids
        np.zeros((height, width), dtype=np.float32),  # light summed over the exposure
        np.zeros(CAM_SIZE),  # the lens at a moment of the exposure
    )


def _pose(
    p: CameraParams,
    ego: Any,
    place: tuple[float, float, float],
    gaze: tuple[float, float] | None,
    time_s: float,
) -> Pose:
    """Pose of the lens with the ego at `place`: x, y [m] and heading [rad]."""
    px, py, heading = place
    x, y, z = mounted_pose(px, py, heading, ego.LENGTH, p.mount_height, p.mount_setback, p.mount_left)
    if p.heave_m > 0.0:
        z = max(z + body_heave(p, ego, time_s), 0.1 * z)  # never into the ground
    yaw, pitch = p.yaw_deg, p.pitch_deg
    if gaze is not None:
        yaw, pitch = yaw + gaze[0], pitch + gaze[1]
    elif p.gaze == "path":
        yaw += math.degrees(_path_yaw(ego))
    return Pose(x, y, z, heading + math.radians(yaw), math.radians(pitch) + body_pitch(p, ego, time_s))


def _slip_and_rate(ego: Any) -> tuple[float, float]:
    """Direction of travel off the heading [rad], and yaw rate [rad/s], of a kinematic bicycle."""
    steering = (getattr(ego, "action", None) or {}).get("steering", 0.0)
    slip = math.atan(0.5 * math.tan(steering))
    return slip, ego.speed * math.sin(slip) / (0.5 * ego.LENGTH)


def _path_yaw(ego: Any) -> float:
    """Direction, from the car's heading, of where it will be in a second on its present circle [rad]."""
    slip, rate = _slip_and_rate(ego)
    return max(-_PATH_MAX, min(_PATH_MAX, slip + 0.5 * (rate * _PATH_S)))


def _earlier(ego: Any, ago_s: float) -> tuple[float, float, float]:
    """Where the ego was a moment ago: x, y [m] and heading [rad]."""
    slip, rate = _slip_and_rate(ego)
    heading = float(ego.heading)
    way, course = ego.speed * ago_s, heading + slip - 0.5 * rate * ago_s
    x, y = float(ego.position[0]) - way * math.cos(course), float(ego.position[1]) - way * math.sin(course)
    return x, y, heading - rate * ago_s
