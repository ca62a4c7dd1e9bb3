"""CameraBatch: cameras of one frame size on the egos of many environments."""

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.camera.aim import FIXED, GAZES
from lgmd_gym.camera.effects import LOOK, beam_profile, in_world, look_of, texture_gains
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.pose import MOUNT, mount_of
from lgmd_gym.camera.render.buffers import Views
from lgmd_gym.camera.render.raster import SharedTables, Workspace, draw_cameras, tables_key
from lgmd_gym.camera.render.sensor import STATE_SIZE
from lgmd_gym.kernels.bundle import Bundle


class _Prepared(NamedTuple):
    """What the kernels read of one camera's parameters."""

    mount: np.ndarray
    look: np.ndarray
    beam: np.ndarray
    tables_key: tuple[Any, ...]
    params: CameraParams


@lru_cache(maxsize=512)
def _prepare(p: CameraParams) -> _Prepared:
    p = in_world(p)
    return _Prepared(mount_of(p), look_of(p), beam_profile(p), tables_key(p), p)


class CameraBatch:
    """Cameras of one frame size on the egos of many environments, drawn by one compiled call.

    Args:
        params: Parameters of the cameras (the members of the batch), the same for every environment at
            first; None for a member that is drawn by other means.
        shape: `(height, width)` of the frames [px].
        cameras: Index of each member in the spans of the roads.
        num_envs: Number of environments.

    Attributes:
        lenses: `LENS` records of the last frames at the end and at the start of the exposure, shape
            (num_envs, members, 2).
    """

    def __init__(
        self,
        params: Sequence[CameraParams | None],
        shape: tuple[int, int],
        cameras: Sequence[int] = (0,),
        num_envs: int = 1,
    ) -> None:
        self.shape = shape
        size = (num_envs, len(params))
        self.lenses = np.zeros((*size, 2), LENS)
        self._cameras = np.array(cameras, dtype=np.int64)
        self._mounts = np.zeros(size, MOUNT)
        self._tables_indices = np.full(size, -1, dtype=np.int64)
        self._views = Views(
            looks=np.zeros(size, LOOK),
            beams=np.zeros((*size, shape[1]), dtype=np.float32),
            skies=np.zeros((*size, *shape), dtype=np.float32),
            sky_aims=np.full((*size, 3), np.nan),
            noise_starts=np.zeros(size, dtype=np.int64),
            exposures=np.full((*size, STATE_SIZE), np.nan),
        )
        # Index of the tables, camera, mount and lenses of each camera, and the fields of its view.
        self._bundle = Bundle(
            self._tables_indices, self._cameras, self._mounts, self.lenses, tuple(self._views)
        )
        self._tables: dict[tuple[Any, ...], tuple[int, SharedTables]] = {}
        self._next_index = 0
        for member, p in enumerate(params):
            if p is not None:
                self.set_params(slice(None), member, p)

    def set_params(
        self, index: int | slice, member: int, p: CameraParams, texture: float | None = None
    ) -> None:
        """Set the parameters of one camera.

        Args:
            index: Environment, or a slice of the environments.
            member: Index of the camera in the batch.
            p: Its parameters, of the shape of the batch.
            texture: Contrast of the ground in place of that of `p`.
        """
        prepared = _prepare(p)
        self._mounts[index, member] = prepared.mount
        self._views.looks[index, member] = prepared.look
        self._views.beams[index, member] = prepared.beam
        self._views.sky_aims[index, member] = np.nan  # redraw the sky
        self._views.exposures[index, member] = np.nan  # adapt to the next frame
        if texture is not None:
            for name, gain in texture_gains(prepared.params, texture).items():
                self._views.looks[name][index, member] = gain
        if prepared.tables_key not in self._tables:
            self._tables[prepared.tables_key] = self._next_index, SharedTables(prepared.params)
            self._next_index += 1
        used = self._tables[prepared.tables_key][0]
        if not np.all(self._tables_indices[index, member] == used):
            self._tables_indices[index, member] = used
            in_use = set(self._tables_indices.ravel().tolist())
            self._tables = {key: item for key, item in self._tables.items() if item[0] in in_use}

    def turn(self, index: int, member: int, p: CameraParams, gaze: tuple[float, float] | None) -> None:
        """Turn a camera relative to its mount, in place of the gaze of its parameters `p`.

        Args:
            index: Environment.
            member: Index of the camera in the batch.
            p: Its parameters.
            gaze: Turn to the right and upwards [degrees]; None for the gaze of the parameters.
        """
        mount, mounted = self._mounts[index, member], _prepare(p).mount
        right, up = gaze or (0.0, 0.0)
        mount["yaw_deg"], mount["pitch_deg"] = mounted["yaw_deg"] + right, mounted["pitch_deg"] + up
        mount["gaze"] = GAZES[p.gaze] if gaze is None else FIXED

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
        for used, tables in self._tables.values():
            inputs = workspace.join(self._bundle, scene_table, roads, tables.bundle)
            draw_cameras(first, last, used, frames, selected, inputs.native)
