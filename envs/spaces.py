# pyright: standard
# Not strict: highway-env states few types.
"""Action and observation types of `BrakingEnv`, which those of `TrafficEnv` extend."""

from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, cast

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.action import ActionType
from highway_env.envs.common.observation import ObservationType
from numpy.typing import ArrayLike

from lgmd_gym.aliases import Config
from lgmd_gym.envs.dynamics.units import MAX_SPEED
from lgmd_gym.envs.highway.road import EgoCar
from lgmd_gym.errors import check_items, check_keys, check_known, check_within

if TYPE_CHECKING:
    from lgmd_gym.envs.base import EgoBrakeEnv
    from lgmd_gym.envs.braking import BrakingEnv


class Demands:
    """Longitudinal demands of actions, on arrays over N environments.

    Args:
        table: Demands of discrete actions; None for actions that are demands.
    """

    def __init__(self, table: Sequence[float] | None = None) -> None:
        self._table = None if table is None else np.array(table, np.float64)

    def read(self, actions: ArrayLike, num_envs: int) -> np.ndarray:
        """Return the demands in [-1, 1], float64, shape (num_envs,).

        Args:
            actions: One number per environment, shape (num_envs,) or (num_envs, 1).
            num_envs: Number of environments.

        Raises:
            ValueError: If the actions have another shape, or one is not finite or no index of a demand.
        """
        values = _numbers(actions, num_envs)
        if self._table is None:
            _check_each(values, np.isfinite(values), "a finite number in [-1, 1]")
            return np.minimum(np.maximum(values, -1.0), 1.0)  # faster than np.clip
        last = len(self._table) - 1
        known = (values >= 0) & (values <= last) & (values == np.floor(values))
        _check_each(values, known, f"an index in [0, {last}]")
        return self._table[values.astype(np.int64)]


def _numbers(actions: ArrayLike, num_envs: int) -> np.ndarray:
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


def _check_each(values: np.ndarray, valid: np.ndarray, kind: str) -> None:
    """Raise ValueError for the first invalid value."""
    if not valid.all():
        index = int(np.argmin(valid))
        where = f" in environment {index}" if len(values) > 1 else ""
        raise ValueError(f"an action must be {kind}, got {values[index]:g}{where}")


class ContinuousDemand(ActionType):
    """A longitudinal demand in [-1, 1]: −1 full brake, 0 hold the scripted speed, +1 full throttle."""

    decoder = Demands()

    def space(self) -> spaces.Space:
        """Return Box(-1, 1, (1,), float32)."""
        return spaces.Box(-1.0, 1.0, shape=(1,), dtype=np.float32)

    @property
    def vehicle_class(self) -> Callable:
        """Class of the controlled car."""
        return EgoCar

    def act(self, action: ArrayLike) -> None:
        """Set the demand of the ego, clipped to [-1, 1].

        Args:
            action: One number, an array of shape () or (1,).

        Raises:
            ValueError: If the action is not one finite number, or no index of a demand.
        """
        (demand,) = self.decoder.read(np.reshape(action, -1), 1).tolist()
        cast(EgoCar, self.controlled_vehicle).demand(demand)


class DiscreteDemand(ContinuousDemand):
    """An index into a list of longitudinal demands.

    Args:
        env: The environment.
        demands: Demands in [-1, 1], one per action.
    """

    def __init__(self, env: "EgoBrakeEnv", demands: Sequence[float] = (0.0, -0.5, -1.0)) -> None:
        super().__init__(env)
        if not check_items("demands", demands, Real, "numbers"):
            raise ValueError("demands must contain at least one number in [-1, 1], got none")
        self.demands = tuple(check_within("demands", demand, -1.0, 1.0) for demand in demands)
        self.decoder = Demands(self.demands)

    def space(self) -> spaces.Space:
        """Return Discrete(len(demands))."""
        return spaces.Discrete(len(self.demands))


class EgoState(ObservationType):
    """Ego speed [m/s], acceleration [m/s²] and yaw rate [rad/s, + right]."""

    def space(self) -> spaces.Space:
        """Return a float32 Box of shape (3,) with the exact bounds."""
        high = np.array([MAX_SPEED + 1.0, 12.0, np.pi], dtype=np.float32)
        low = np.array([0.0, -12.0, -np.pi], dtype=np.float32)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self) -> np.ndarray:
        """Return the current state, float32, shape (3,)."""
        return cast("BrakingEnv", self.env).simulation.ego_states()[0]


ACTIONS = {"ContinuousDemand": ContinuousDemand, "DiscreteDemand": DiscreteDemand}


def make_action(
    env: "EgoBrakeEnv", config: Config, types: Mapping[str, type[ContinuousDemand]] = ACTIONS
) -> ContinuousDemand:
    """Return the action type for `config["action"]`.

    Args:
        env: The environment.
        config: `type`, a key of `types`, and for "DiscreteDemand" optionally `demands`.
        types: Action types of the environment.

    Raises:
        ValueError: If the type or a key is unknown, or a value is out of range.
    """
    arguments = dict(config)
    name = arguments.pop("type", None)
    check_known("action type", name, types)
    known = {"demands"} if name == "DiscreteDemand" else set()
    check_keys(f"key of config['action'] for {name}", arguments, known)
    return types[name](env, **arguments)
