"""Action and observation types of `BrakingEnv`, which those of `TrafficEnv` extend."""

from collections.abc import Callable, Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.action import ActionType
from highway_env.envs.common.observation import ObservationType

from lgmd_gym.envs.dynamics.units import MAX_SPEED
from lgmd_gym.envs.highway.road import EgoCar
from lgmd_gym.errors import check_items, check_keys, check_known, check_within

if TYPE_CHECKING:
    from lgmd_gym.envs.base import EgoBrakeEnv


class ContinuousDemand(ActionType):
    """A longitudinal demand in [-1, 1]: −1 full brake, 0 hold the scripted speed, +1 full throttle."""

    def space(self) -> spaces.Space:
        """Return Box(-1, 1, (1,), float32)."""
        return spaces.Box(-1.0, 1.0, shape=(1,), dtype=np.float32)

    @property
    def vehicle_class(self) -> Callable:
        """Class of the controlled car."""
        return EgoCar

    def act(self, action: Any) -> None:
        """Set the demand of the ego, clipped to [-1, 1].

        Raises:
            ValueError: If the action is not one finite number.
        """
        values = np.asarray(action, dtype=np.float64).reshape(-1)
        if values.size != 1 or not np.isfinite(values[0]):
            raise ValueError(f"action must be one finite number in [-1, 1], got {action!r}")
        cast(EgoCar, self.controlled_vehicle).demand(min(max(float(values[0]), -1.0), 1.0))


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

    def space(self) -> spaces.Space:
        """Return Discrete(len(demands))."""
        return spaces.Discrete(len(self.demands))

    def act(self, action: Any) -> None:
        """Set the demand of the ego.

        Raises:
            ValueError: If the index is out of range.
        """
        if not 0 <= int(action) < len(self.demands):
            raise ValueError(f"action must be an index in [0, {len(self.demands) - 1}], got {action!r}")
        cast(EgoCar, self.controlled_vehicle).demand(self.demands[int(action)])


class EgoState(ObservationType):
    """Ego speed [m/s], acceleration [m/s²] and yaw rate [rad/s, + right]."""

    def space(self) -> spaces.Space:
        """Return a float32 Box of shape (3,) with the exact bounds."""
        high = np.array([MAX_SPEED + 1.0, 12.0, np.pi], dtype=np.float32)
        low = np.array([0.0, -12.0, -np.pi], dtype=np.float32)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self) -> np.ndarray:
        """Return the current state, float32, shape (3,)."""
        if self.env.vehicle is None:
            return np.zeros(3, dtype=np.float32)
        ego = cast(EgoCar, self.env.vehicle)
        return np.array([ego.speed, ego.acceleration, ego.yaw_rate], dtype=np.float32)


ACTIONS = {"ContinuousDemand": ContinuousDemand, "DiscreteDemand": DiscreteDemand}


def make_action(
    env: "EgoBrakeEnv", config: dict[str, Any], types: Mapping[str, type[ContinuousDemand]] = ACTIONS
) -> ActionType:
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
