# pyright: standard
# Not strict: the type of a random draw of NumPy depends on its arguments.
"""Interquartile mean, and a stratified bootstrap over training runs and cases."""

import numpy as np
from numpy.typing import ArrayLike

from lgmd_gym.statistics.intervals import DRAWS


def interquartile_mean(values: ArrayLike) -> np.ndarray:
    """Return the mean of the middle half along the last axis; of fewer than four values, the mean of all.

    Example:
        >>> float(interquartile_mean([0.0, 1.0, 2.0, 3.0, 100.0]))
        2.0
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=-1)
    cut = ordered.shape[-1] // 4
    return ordered[..., cut : ordered.shape[-1] - cut].mean(axis=-1)


class StratifiedBootstrap:
    """Bootstrap samples of cases, drawn from threats and non-threats separately and shared by all arms.

    Args:
        threat: Whether a case is a threat, by name.
    """

    def __init__(self, threat: dict[str, bool]) -> None:
        self.cases = sorted(threat)
        self._weights = np.zeros((DRAWS, len(self.cases)))
        rng = np.random.default_rng(0)
        for kind in (True, False):
            chosen = np.array([threat[case] is kind for case in self.cases])
            n = int(chosen.sum())
            if n:
                self._weights[:, chosen] = rng.multinomial(n, np.full(n, 1.0 / n), size=DRAWS)

    def means(self, values: np.ndarray, seed: int) -> np.ndarray:
        """Return means over sampled cases of sampled training runs, shape (samples, trainings).

        Args:
            values: Shape (trainings, cases); NaN where a case has no value.
            seed: Seed of the sampling of training runs.
        """
        defined = np.isfinite(values[0])
        weights = self._weights[:, defined]
        means = (weights @ values[:, defined].T) / weights.sum(axis=1, keepdims=True)
        picks = np.random.default_rng(seed).integers(len(values), size=means.shape)
        return np.take_along_axis(means, picks, axis=1)
