"""AdaptiveLGMD: the LGMD with an alarm threshold that follows the mean of its spike frequency."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lgmd_gym.fields import Record, number, record, whole
from lgmd_gym.neuron.lgmd.model import LGMD, register_variant
from lgmd_gym.neuron.lgmd.params import NeuronSpec
from lgmd_gym.neuron.scalars import ALERT, FREQUENCY
from lgmd_gym.neuron.validation import Frames


@record
class AdaptiveParams(Record):
    """Parameters of the threshold of `AdaptiveLGMD`."""

    label = "AdaptiveLGMD"
    gain: float = number(3.0, "[0, inf)", "", "Ratio of the threshold to the mean spike frequency.")
    memory: int = whole(60, "[1, 100000]", "frames", "Time constant of the mean.")


class AdaptiveLGMD(LGMD):
    """One or N LGMDs whose spike frequency passes only where it exceeds a multiple of its running mean.

    The paper proposes an adaptive threshold as future work. With f the spike frequency of the LGMD:

    1. f'(t) = f(t) where f(t) >= `gain` m(t-1), else 0. This is the output `spike_frequency`.
    2. m(t) = m(t-1) + (f(t) - m(t-1)) / `memory`: running mean.

    An alarm at f' >= t_sf is therefore one of f at max(t_sf, `gain` m), as of the agent `adaptive-threshold`.
    All other outputs are those of the LGMD.

    Args:
        shape: (height, width) of the frames [px].
        fps: Frame rate [Hz].
        params: Parameters of the LGMD, or a mapping of them; None for the defaults.
        num: Number of neurons N, each with its own frames; None for a single one with scalar outputs.
        threshold: Parameters of the threshold, or a mapping of them; None for the defaults.

    Raises:
        ValueError: For an argument out of range.
        TypeError: For an argument of another type.

    Example:
        >>> import numpy as np
        >>> neuron = AdaptiveLGMD((90, 160), fps=30.0)
        >>> neuron.step(np.zeros((90, 160), np.uint8)).spike_frequency
        0.0
    """

    def __init__(
        self,
        shape: tuple[int, int],
        fps: float = 30.0,
        params: NeuronSpec = None,
        num: int | None = None,
        *,
        threshold: AdaptiveParams | Mapping[str, object] | None = None,
    ) -> None:
        self.threshold = AdaptiveParams.make(threshold)
        super().__init__(shape, fps, params, num)
        self._mean = np.zeros(self._count)

    def step_range(self, first: int, last: int, frames: Frames, active: NDArray[np.bool_]) -> None:
        """Step the active neurons among first..last-1; see `FrameNeuron.step_range`."""
        super().step_range(first, last, frames, active)
        rows = first + np.flatnonzero(active[first:last])
        frequency, mean = self._scalars[rows, FREQUENCY], self._mean[rows]
        passed = np.where(frequency >= self.threshold.gain * mean, frequency, 0.0)
        self._mean[rows] = mean + (frequency - mean) / self.threshold.memory
        self._scalars[rows, FREQUENCY] = passed
        self._scalars[rows, ALERT] = passed >= self.params.t_sf

    def reset(self, mask: ArrayLike | None = None) -> None:
        """Return to the state before the first frame; see `FrameNeuron.reset`."""
        super().reset(mask)
        self._mean[self._all_active if mask is None else np.asarray(mask)] = 0.0


register_variant(
    "adaptive-threshold",
    AdaptiveLGMD,
    AdaptiveParams,
    "threshold",
    "LGMD with an alarm threshold that follows the mean spike frequency.",
)
