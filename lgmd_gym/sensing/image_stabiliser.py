"""ImageStabiliser: measures the rotation of the ego's body with one far-field camera per environment.

It is fixed to the car at the place of the first camera with `stabilised="image"`. It has 160 columns
over 24° and the horizon at half height, 6.6 px/°. Its frames are drawn before those of the cameras, and the
rotation that they show is subtracted from the rotation of the body in the same camera frame.

At the start of an episode, the reference of the registration is a frame without motion of the body. This is
an assumption: a car that has driven for minutes knows the mean direction of its camera. Another one is that
the car knows by how much it has turned since the last frame.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np

from lgmd_gym.camera import CameraParams
from lgmd_gym.camera.batch import CameraBatch
from lgmd_gym.camera.render.bundle import Bundle
from lgmd_gym.camera.render.context import Workspace
from lgmd_gym.sensing.registration import FarFieldRegistration

FAR_SHAPE, FAR_HFOV_DEG = (48, 160), 24.0
"""Shape (height, width) [px] and horizontal field of view [degrees] of the far-field camera."""


def far_camera(cameras: Sequence[CameraParams | None]) -> CameraParams | None:
    """Return the far-field camera of an environment; None if the image stabilises no camera.

    Args:
        cameras: Cameras of the environment; None for a top view.
    """
    base = next((p for p in cameras if p is not None and p.stabilised == "image"), None)
    if base is None:
        return None
    return replace(
        base,
        name="far field",
        shape=FAR_SHAPE,
        hfov_deg=FAR_HFOV_DEG,
        detector="lgmd",
        columns=0,
        gaze="fixed",
        yaw_deg=0.0,
        pitch_deg=0.0,
        contrast_s=0.0,
        bonnet=False,
        windscreen=0.0,
        stabilised=False,
    )


class ImageStabiliser:
    """One far-field camera per environment, and the registration of their frames.

    Args:
        camera: The far-field camera, see `far_camera`.
        fps: Camera frame rate [Hz].
        num_envs: Number of environments.
        span: Index of the camera in the spans of the roads.

    Attributes:
        frames: The last frames, uint8, shape (num_envs, 1, height, width).
        registration: The registrations; `rotations` are the last estimates.
    """

    def __init__(self, camera: CameraParams, fps: float, num_envs: int, span: int) -> None:
        # The camera with and without motion of the body.
        self._batches = [CameraBatch([p], camera.shape, [span], num_envs) for p in (camera, _steady(camera))]
        self.frames = np.zeros((num_envs, 1, *camera.shape), np.uint8)
        self.registration = FarFieldRegistration(camera.shape, fps, camera.focal_px, num_envs)
        self._selected = np.zeros((num_envs, 1), np.bool_)
        self._headings, self._turns = np.zeros(num_envs), np.zeros(num_envs)
        self._workspaces: list[Workspace] = []

    def set_params(self, index: int, camera: CameraParams, texture: float | None) -> None:
        """Set the camera of environment `index`, and forget its reference.

        Args:
            index: Index of the environment.
            camera: The camera, see `far_camera`.
            texture: Contrast of the ground in place of that of the camera.
        """
        for batch, p in zip(self._batches, (camera, _steady(camera)), strict=True):
            batch.set_params(index, 0, p, texture)
        selected = np.zeros(len(self.frames), np.bool_)
        selected[index] = True
        self.reset(selected)

    def process(
        self, first: int, last: int, active: np.ndarray, scene_table: Bundle, roads: Bundle
    ) -> np.ndarray:
        """Draw and register a frame of the active environments among first..last-1.

        Threads may process disjoint ranges at once.

        Args:
            first: First environment.
            last: Last environment + 1.
            active: Environments with a new frame, bool, shape (num_envs,).
            scene_table: `SceneTable.bundle`.
            roads: `RoadPool.bundle`.

        Returns:
            Pitch, roll and yaw of the body of all environments, float64, shape (num_envs, 3) [degrees].
        """
        here, registration = slice(first, last), self.registration
        headings = scene_table.arrays[0]["heading"][here]
        new = active[here] & ~registration.started[here]
        if new.any():
            self._draw(1, first, last, new, scene_table, roads)
            self._headings[here][new] = headings[new]
            self._register(first, last, new, 0.0)
        self._draw(0, first, last, active[here], scene_table, roads)
        turns = (headings - self._headings[here] + pi) % (2.0 * pi) - pi
        self._headings[here][active[here]] = headings[active[here]]
        self._register(first, last, active[here], turns)
        return registration.rotations

    def reset(self, mask: np.ndarray) -> None:
        """Forget the references of selected environments, bool, shape (num_envs,)."""
        self.registration.reset(mask)

    def _draw(
        self, batch: int, first: int, last: int, selected: np.ndarray, scene_table: Bundle, roads: Bundle
    ) -> None:
        try:  # threads take and return workspaces; both list operations are atomic
            workspace = self._workspaces.pop()
        except IndexError:
            workspace = Workspace(self.frames.shape[2:])
        self._selected[first:last, 0] = selected
        drawn = self._batches[batch]
        drawn.draw(first, last, scene_table, roads, self.frames, self._selected, workspace)
        self._workspaces.append(workspace)

    def _register(self, first: int, last: int, selected: np.ndarray, turns: np.ndarray | float) -> None:
        self._turns[first:last] = turns
        self._selected[first:last, 0] = selected
        self.registration.step_range(first, last, self.frames[:, 0], self._turns, self._selected[:, 0])

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_workspaces": []}


def _steady(camera: CameraParams) -> CameraParams:
    """Return the camera without motion of the body."""
    return replace(camera, road="still", dive_deg=0.0)
