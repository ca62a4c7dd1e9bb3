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

        Raises:
            ValueError: If the number of actions is not `num_envs`, or an action is not finite or no index of
                a demand.
        """
        values = np.asarray(actions, dtype=np.float64).reshape(-1)
        if values.size != num_envs:
            raise ValueError(f"actions must be {num_envs} numbers, one per environment, got {values.size}")
        if self._table is not None:
            indices = values.astype(np.int64)
            if not ((indices >= 0) & (indices < len(self._table))).all():
                raise ValueError(f"actions must be indices in [0, {len(self._table) - 1}], got {actions!r}")
            return self._table[indices]
        if not np.isfinite(values).all():
            raise ValueError(f"actions must be finite numbers in [-1, 1], got {actions!r}")
        return np.clip(values, -1.0, 1.0)
