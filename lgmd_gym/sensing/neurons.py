"""NeuronGroup: the neurons of channels with one frame size, one model and one number of columns."""

import numpy as np

from lgmd_gym.kernels.bundle import Bundle
from lgmd_gym.neuron.base import FrameNeuron
from lgmd_gym.sensing.drawing import FrameGroup
from lgmd_gym.sensing.kernels import collect_outputs, count_turns, select_cameras


class NeuronGroup:
    """Neurons behind the cameras of a `FrameGroup`.

    Args:
        neuron: num_envs * len(members) neurons, ordered by environment, then by channel.
        members: Indices of the channels.
        group: Their cameras.
        enabled: Channels in use, bool, shape (num_envs, channels).
        stale: Channels that have missed a frame, bool, shape (num_envs, channels).
        outputs: Outputs of all neurons, see `collect_outputs`.
        columns: Number of columns of each channel; 0 for none.
        derotated: Whether the views are derotated.

    Attributes:
        neuron: The neurons.
        members: Indices of the channels.
        selected: Channels with a new frame, bool, shape (num_envs, members).
        columns: The last potentials of the columns, float64, shape (num_envs, members, columns).
    """

    def __init__(
        self,
        neuron: FrameNeuron,
        members: list[int],
        group: FrameGroup,
        enabled: np.ndarray,
        stale: np.ndarray,
        outputs: tuple[np.ndarray, np.ndarray, np.ndarray],
        columns: int,
        derotated: bool,
    ) -> None:
        self.neuron, self.members, self.group, self._derotated = neuron, members, group, derotated
        size = len(enabled), len(members)
        self.columns = np.full((*size, columns), 0.5)
        self._yaws_px, self._turns_px = np.zeros(size), np.zeros(size, np.int64)
        self.selected, self._fresh = np.zeros(size, np.bool_), np.zeros(size, np.bool_)
        channels = np.array(members, dtype=np.int64)
        self._selection = Bundle(channels, enabled, stale, self.selected, self._fresh)
        self._neurons = Bundle(channels, neuron.outputs, *outputs)

    def select(self, first: int, last: int, active: np.ndarray) -> bool:
        """Select the channels with a new frame, and reset the neurons that have missed a frame.

        Args:
            first: First environment.
            last: Last environment + 1.
            active: Environments with a new frame, bool, shape (num_envs,).

        Returns:
            Whether a channel is selected.
        """
        num_selected, num_fresh = select_cameras(first, last, active, self._selection.native)
        if num_fresh:
            fresh = np.zeros_like(self._fresh)
            fresh[first:last] = self._fresh[first:last]
            self.neuron.reset(fresh.ravel())
        return num_selected > 0

    def step(self, first: int, last: int) -> None:
        """Process the frames of the selected channels of the environments first..last-1."""
        count, batch = len(self.members), self.group.batch
        frames, selected = self.group.frames.reshape(-1, *batch.shape), self.selected.reshape(-1)
        if self._derotated and count_turns(
            first, last, self.selected, batch.lenses, self._yaws_px, self._turns_px
        ):
            turns_px = self._turns_px.reshape(-1)
            self.neuron.shift_range(first * count, last * count, frames, selected, turns_px)
        self.neuron.step_range(first * count, last * count, frames, selected)
        self._collect(first, last, self.selected)

    def reset(self, mask: np.ndarray) -> None:
        """Reset the neurons of selected environments, bool, shape (num_envs,)."""
        selected = np.repeat(mask[:, None], len(self.members), axis=1)
        self.neuron.reset(selected.ravel())
        self._collect(0, len(mask), selected)

    def _collect(self, first: int, last: int, selected: np.ndarray) -> None:
        """Write the outputs and the potentials of the columns of selected neurons."""
        collect_outputs(first, last, selected, self._neurons.native)
        count, columns = self.columns.shape[1:]
        if columns:
            rows = self.columns.reshape(-1, columns)
            self.neuron.read_columns(first * count, last * count, selected.reshape(-1), rows)
