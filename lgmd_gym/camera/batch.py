"""CameraBatch: cameras of one frame size on the egos of many environments."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.camera import Camera
from lgmd_gym.camera.effects import LOOK, beam_profile, in_scene, look_of, texture_gains
from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.pose import FIXED, GAZE_NUMBERS, MOUNT, USUAL_BRAKE, mount_of
from lgmd_gym.camera.render.buffers import Views
from lgmd_gym.camera.render.raster import Workspace, draw_cameras
from lgmd_gym.camera.render.sensor import STATE_SIZE
from lgmd_gym.camera.render.tables import PLACES, SharedTables
from lgmd_gym.camera.scene import Scene
from lgmd_gym.kernels.bundle import Bundle


class _Prepared(NamedTuple):
    """What the kernels read of one camera in a scene."""

    mount: np.ndarray
    look: np.ndarray
    beam: np.ndarray
    camera: Camera  # in the scene


@lru_cache(maxsize=512)
def _prepare(camera: Camera, scene: Scene, max_deceleration: float) -> _Prepared:
    camera = in_scene(camera, scene)
    return _Prepared(
        mount=mount_of(camera, scene, max_deceleration),
        look=look_of(camera, scene),
        beam=beam_profile(camera),
        camera=camera,
    )


class CameraBatch:
    """Cameras of one frame size on the egos of many environments, drawn by one compiled call.

    Args:
        cameras: The cameras (the members of the batch), in the laboratory at first; None for a member that is
            drawn by other means.
        shape: `(height, width)` of the frames [px].
        num_envs: Number of environments.

    Attributes:
        lenses: `LENS` records of the last frames at the end and at the start of the exposure, shape
            (num_envs, members, 2).
        bundle: The arrays that `draw_cameras` reads.
    """

    def __init__(
        self,
        cameras: Sequence[Camera | None],
        shape: tuple[int, int],
        num_envs: int = 1,
    ) -> None:
        self.shape, self._cameras = shape, tuple(cameras)
        size = (num_envs, len(cameras))
        self.lenses = np.zeros((*size, 2), LENS)
        self._mounts = np.zeros(size, MOUNT)
        self._tables = np.full(size, None)  # the `SharedTables` of each camera
        self._places = np.zeros((*size, *PLACES), np.int64)  # an address of 0 for no tables
        self._views = Views(
            looks=np.zeros(size, LOOK),
            beams=np.zeros((*size, shape[1]), dtype=np.float32),
            skies=np.zeros((*size, *shape), dtype=np.float32),
            sky_aims=np.full((*size, 3), np.nan),
            noise_starts=np.zeros(size, dtype=np.int64),
            exposures=np.full((*size, STATE_SIZE), np.nan),
        )
        # Places of the tables, mount and lenses of each camera, and the fields of its view.
        self.bundle = Bundle(self._places, self._mounts, self.lenses, tuple(self._views))
        self.set_scene(slice(None), Scene())

    def set_scene(self, index: int | slice, scene: Scene, max_deceleration: float = USUAL_BRAKE) -> None:
        """Set the scene of an environment.

        Args:
            index: Environment, or a slice of the environments.
            scene: The scene.
            max_deceleration: Full braking of the car [m/s²].

        Raises:
            ValueError: If a camera does not fit the scene, see `in_scene`.
        """
        # Environments draw the texture at random, and it changes two numbers only.
        plain = scene if scene.texture == 1.0 else replace(scene, texture=1.0)
        for member, camera in enumerate(self._cameras):
            if camera is not None:
                prepared = _prepare(camera, plain, max_deceleration)
                self._set(index, member, prepared, texture_gains(scene, prepared.camera.sensor.linear_light))
                # Not part of `_prepare`, which would keep the arrays of many scenes.
                tables = SharedTables(prepared.camera, plain)
                self._tables[index, member], self._places[index, member] = tables, tables.places

    def _set(self, index: int | slice, member: int, prepared: _Prepared, gains: Mapping[str, float]) -> None:
        """Write what the kernels read of one camera."""
        self._mounts[index, member] = prepared.mount
        self._views.looks[index, member] = prepared.look
        self._views.beams[index, member] = prepared.beam
        self._views.sky_aims[index, member] = np.nan  # redraw the sky
        self._views.exposures[index, member] = np.nan  # adapt to the next frame
        for name, gain in gains.items():
            self._views.looks[name][index, member] = gain

    def turn(self, member: int, scene: Scene, turn: tuple[float, float] | None) -> None:
        """Turn a camera of the first environment relative to its mount, in place of its gaze.

        Args:
            member: Index of the camera in the batch.
            scene: The scene.
            turn: Turn to the right and upwards [degrees]; None for the gaze of the camera.
        """
        camera = self._cameras[member]
        assert camera is not None
        mount, mounted = self._mounts[0, member], mount_of(in_scene(camera, scene), scene)
        right, up = turn or (0.0, 0.0)
        mount["yaw_deg"], mount["pitch_deg"] = mounted["yaw_deg"] + right, mounted["pitch_deg"] + up
        mount["gaze"] = GAZE_NUMBERS[camera.gaze.kind] if turn is None else FIXED

    def draw(
        self,
        first: int,
        last: int,
        scene_table: Bundle,
        roads: Bundle,
        frames: np.ndarray,
        selected: np.ndarray,
        workspace: Workspace,
    ) -> None:
        """Draw the selected cameras of the environments first..last-1; see `draw_cameras`.

        Threads may draw disjoint ranges at once, each with a workspace of its own.
        """
        inputs = workspace.join(self.bundle, scene_table, roads)
        draw_cameras(first, last, frames, selected, inputs.native)

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        for place, tables in np.ndenumerate(self._tables):
            if tables is not None:
                self._places[place] = tables.places
