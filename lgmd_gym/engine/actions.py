"""Demands: batches of actions as longitudinal demands."""

from typing import Any

import numpy as np

from lgmd_gym.envs.spaces import DiscreteDemand


class Demands:
    """Converts the actions of a vector environment; see `ContinuousDemand` and `DiscreteDemand`.

    Args:
        action_type: Action type of a single environment.
    """

    def __init__(self, action_type: Any) -> None:
        self._table = np.array(action_type.demands) if isinstance(action_type, DiscreteDemand) else None

    def read(self, actions: Any, num_envs: int) -> np.ndarray:
        """Return the demands in [-1, 1], float64, shape (num_envs,).

        Args:
            actions: One number per environment, shape (num_envs,) or (num_envs, 1).
            num_envs: Number of environments.

        Raises:
            ValueError: If the actions have another shape, or one is not finite or no index of a demand.
        """
        values = _numbers(actions, num_envs)
        if not np.isfinite(values).all():
            index = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ValueError(
                f"actions must be finite numbers in [-1, 1], got {values[index]} in environment {index}"
            )
        if self._table is None:
            return np.clip(values, -1.0, 1.0)
        indices = values.astype(np.int64)
        wrong = (indices < 0) | (indices >= len(self._table)) | (indices != values)
        if wrong.any():
            index = int(np.flatnonzero(wrong)[0])
            raise ValueError(
                f"actions must be indices in [0, {len(self._table) - 1}], got {values[index]:g} "
                f"in environment {index}"
            )
        return self._table[indices]


def _numbers(actions: Any, num_envs: int) -> np.ndarray:
    """Return the actions as float64, shape (num_envs,)."""
    try:
        values = np.asarray(actions, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"actions must be {num_envs} numbers, got {actions!r}") from None
    if values.shape not in ((num_envs,), (num_envs, 1)):
        raise ValueError(
            f"actions must be {num_envs} numbers, one per environment, got shape {values.shape}; "
            "use envs.action_space.sample()"
        )
    return values.reshape(-1)
