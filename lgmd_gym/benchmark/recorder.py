"""The time series of episodes, recorded decision by decision."""

from collections.abc import Mapping, Sequence

import numpy as np

from lgmd_gym.sensing.assembly import SIGNALS

GROUND_TRUTH = ("ego_speed", "gap", "ttc", "drac", "deceleration", "target_speed")  # keys of `info`
# One value per decision each; of `SIGNALS`, the maximum over the cameras. `standstill_hold` is 1 while the
# agent keeps a standing ego from starting, which the deceleration does not show.
SERIES = ("time", *GROUND_TRUTH, *SIGNALS, "alert", "standstill_hold")
_ALERT = SERIES.index("alert")
_SIGNALS = 1 + len(GROUND_TRUTH)
_INITIAL_LENGTH = 512  # decisions


class SeriesRecorder:
    """Records the present episode of each of N environments.

    Args:
        num_envs: Number of environments N.
        decision_hz: Decision rate [Hz].
        channels: Names of channels whose spike frequencies are recorded, too, as "spike_frequency/NAME".
    """

    def __init__(self, num_envs: int, decision_hz: float, channels: Sequence[str] = ()) -> None:
        self._decision_hz = decision_hz
        self._names = (*SERIES, *(f"spike_frequency/{name}" for name in channels))
        self._lengths = np.zeros(num_envs, np.int64)
        self._values = np.zeros((num_envs, _INITIAL_LENGTH, len(self._names)))

    def start(self, index: int) -> None:
        """Start a new episode in environment `index`."""
        self._lengths[index] = 0

    def add(
        self,
        active: np.ndarray,
        observations: Mapping[str, np.ndarray],
        infos: Mapping[str, np.ndarray],
        alerts: np.ndarray,
        demands: np.ndarray,
    ) -> None:
        """Append one decision of the active environments.

        Args:
            active: Selection of the environments, bool, shape (N,).
            observations: Observations with the `SIGNALS`, shape (N, cameras).
            infos: Infos with the keys of `GROUND_TRUTH`, shape (N,).
            alerts: Alerts of the agents, bool, shape (N,).
            demands: Demands of the agents, shape (N,).
        """
        if self._lengths.max() == self._values.shape[1]:
            self._values = np.concatenate((self._values, np.zeros_like(self._values)), axis=1)
        rows = np.empty((len(active), len(self._names)))
        rows[:, 0] = self._lengths / self._decision_hz
        for column, name in enumerate(GROUND_TRUTH, 1):
            rows[:, column] = infos[name]
        for column, name in enumerate(SIGNALS, _SIGNALS):
            rows[:, column] = observations[name].max(axis=1)
        rows[:, _ALERT] = alerts
        rows[:, _ALERT + 1] = (rows[:, 1] == 0.0) & (demands < 0.0)
        if len(self._names) > len(SERIES):
            rows[:, len(SERIES) :] = observations["spike_frequency"]
        self._values[active, self._lengths[active]] = rows[active]
        self._lengths[active] += 1

    def series(self, index: int) -> dict[str, np.ndarray]:
        """Return arrays of shape (decisions,) by name for the present episode of an environment."""
        values = self._values[index, : self._lengths[index]]
        return {name: values[:, column].copy() for column, name in enumerate(self._names)}
