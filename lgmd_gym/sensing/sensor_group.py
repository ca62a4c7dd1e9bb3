"""SensorGroup: the cameras of a sensor array with one frame shape and one detector, and their neurons."""

from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from lgmd_gym.camera import CameraParams
from lgmd_gym.camera.batch import CameraBatch
from lgmd_gym.camera.render.raster import Workspace
from lgmd_gym.kernels.bundle import Bundle
from lgmd_gym.neuron import FrameNeuron
from lgmd_gym.sensing.kernels import collect_outputs, count_turns, select_cameras


class SensorGroup:
    """Cameras with one frame shape, one detector and one number of columns, and their neurons.

    Args:
        neuron: num_envs * len(members) neurons, ordered by environment, then by camera.
        members: Indices of the cameras.
        params: Parameters of all cameras of the array; None for a top view.
        enabled: Cameras in use, bool, shape (num_envs, cameras).
        stale: Cameras that have missed a frame, bool, shape (num_envs, cameras).
        outputs: Outputs of all neurons, see `collect_outputs`.
        columns: Number of columns of each camera; 0 for none.

    Attributes:
        members: Indices of the cameras.
        batch: The cameras.
        neuron: The neurons.
        frames: The last frames, uint8, shape (num_envs, members, height, width).
        columns: The last potentials of the columns, float64, shape (num_envs, members, columns).
    """

    def __init__(
        self,
        neuron: FrameNeuron,
        members: list[int],
        params: Sequence[CameraParams | None],
        enabled: np.ndarray,
        stale: np.ndarray,
        outputs: tuple[np.ndarray, np.ndarray, np.ndarray],
        columns: int = 0,
    ) -> None:
        self.members = members
        size = num_envs, _ = len(enabled), len(members)
        self.neuron, shape = neuron, neuron.shape
        self.batch = CameraBatch([params[k] for k in members], shape, members, num_envs)
        self.frames = np.zeros((*size, *shape), np.uint8)
        self.columns = np.full((*size, columns), 0.5)
        cameras = np.array(members, dtype=np.int64)
        self._shares = False
        self._derotated = any(p is not None and p.derotated for p in (params[k] for k in members))
        self._yaws_px, self._turns_px = np.zeros(size), np.zeros(size, np.int64)
        self._selected, self._fresh = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
        self._selection = Bundle(cameras, enabled, stale, self._selected, self._fresh)
        self._neurons = Bundle(cameras, self.neuron.outputs, *outputs)
        self._workspaces: list[Workspace] = []

    def share(self, other: "SensorGroup") -> None:
        """Use the frames of a group with the same views, which is processed before this one."""
        self.batch, self.frames, self._shares = other.batch, other.frames, True

    def separate(self) -> None:
        """Draw own frames from now on, from the state of the shared cameras."""
        if self._shares:
            self.batch, self.frames, self._shares = deepcopy(self.batch), self.frames.copy(), False

    def process(self, first: int, last: int, active: np.ndarray, scene_table: Bundle, roads: Bundle) -> None:
        """Draw and process a frame of every enabled camera of active environments among first..last-1.

        Args:
            first: First environment.
            last: Last environment + 1.
            active: Environments with a new frame, bool, shape (num_envs,).
            scene_table: `SceneTable.bundle`.
            roads: `RoadPool.bundle`.
        """
        num_selected, num_fresh = select_cameras(first, last, active, self._selection.native)
        if num_selected == 0:
            return
        if num_fresh:  # a neuron that has missed frames starts anew
            fresh = np.zeros_like(self._fresh)
            fresh[first:last] = self._fresh[first:last]
            self.neuron.reset(fresh.ravel())
        if not self._shares:
            self._draw(first, last, scene_table, roads)
        count = len(self.members)
        frames = self.frames.reshape(-1, *self.batch.shape)
        selected = self._selected.reshape(-1)
        if self._derotated and count_turns(
            first, last, self._selected, self.batch.lenses, self._yaws_px, self._turns_px
        ):
            turns_px = self._turns_px.reshape(-1)
            self.neuron.shift_range(first * count, last * count, frames, selected, turns_px)
        self.neuron.step_range(first * count, last * count, frames, selected)
        collect_outputs(first, last, self._selected, self._neurons.native)
        self._read_columns(first, last, self._selected)

    def _read_columns(self, first: int, last: int, selected: np.ndarray) -> None:
        count, columns = self.columns.shape[1:]
        if columns:
            rows = self.columns.reshape(-1, columns)
            self.neuron.read_columns(first * count, last * count, selected.reshape(-1), rows)

    def _draw(self, first: int, last: int, scene_table: Bundle, roads: Bundle) -> None:
        try:  # threads take and return workspaces; both list operations are atomic
            workspace = self._workspaces.pop()
        except IndexError:
            workspace = Workspace(self.batch.shape)
        self.batch.draw(first, last, scene_table, roads, self.frames, self._selected, workspace)
        self._workspaces.append(workspace)

    def reset(self, mask: np.ndarray) -> None:
        """Reset the neurons of selected environments, bool, shape (num_envs,)."""
        selected = np.repeat(mask[:, None], len(self.members), axis=1)
        self.neuron.reset(selected.ravel())
        collect_outputs(0, len(mask), selected, self._neurons.native)
        self._read_columns(0, len(mask), selected)

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_workspaces": []}
