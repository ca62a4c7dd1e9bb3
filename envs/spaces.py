"""What goes in and out of `BrakingEnv`: a longitudinal demand, and the ego's own state."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.action import ActionType
from highway_env.envs.common.observation import ObservationType

from lgmd_gym.envs.dynamics.units import MAX_SPEED, check_within
from lgmd_gym.envs.simulation.vehicles import EgoCar
from lgmd_gym.errors import check_keys, unknown_name

if TYPE_CHECKING:
    from lgmd_gym.envs.braking import BrakingEnv


class ContinuousDemand(ActionType):
    """One number in [-1, 1]: −1 full brake, 0 hold the scripted speed, +1 full throttle."""

    def space(self) -> spaces.Box:
        """Return Box(-1, 1, (1,), float32)."""
        return spaces.Box(-1.0, 1.0, shape=(1,), dtype=np.float32)

    @property
    def vehicle_class(self) -> Callable:
        """The class of the car that takes the demand."""
        return EgoCar

    def act(self, action: Any) -> None:
        """Pass the demand on to the ego; what lies beyond [-1, 1] is clipped.

        Raises:
            ValueError: For an action that is not one finite number.
        """
        values = np.asarray(action, dtype=np.float64).reshape(-1)
        if values.size != 1 or not np.isfinite(values[0]):
            raise ValueError(f"an action is one finite number in [-1, 1], got {action!r}")
        cast(EgoCar, self.controlled_vehicle).demand(min(max(float(values[0]), -1.0), 1.0))


class DiscreteDemand(ActionType):
    """An index into `levels`, each a longitudinal demand in [-1, 1]."""

    def __init__(self, env: "BrakingEnv", levels: tuple[float, ...] = (0.0, -0.5, -1.0)) -> None:
        super().__init__(env)
        if not levels:
            raise ValueError("levels needs at least one demand in [-1, 1], got none")
        self.levels = tuple(check_within("levels", level, -1.0, 1.0) for level in levels)

    def space(self) -> spaces.Discrete:
        """Return Discrete(len(levels))."""
        return spaces.Discrete(len(self.levels))

    @property
    def vehicle_class(self) -> Callable:
        """The class of the car that takes the demand."""
        return EgoCar

    def act(self, action: Any) -> None:
        """Pass the chosen level on to the ego.

        Raises:
            ValueError: For an index outside the levels.
        """
        if not 0 <= int(action) < len(self.levels):
            raise ValueError(f"a discrete action is an index in [0, {len(self.levels) - 1}], got {action!r}")
        cast(EgoCar, self.controlled_vehicle).demand(self.levels[int(action)])


class EgoState(ObservationType):
    """What a car's own sensors tell: speed [m/s], acceleration [m/s²], yaw rate [rad/s, + right]."""

    def space(self) -> spaces.Box:
        """Return a Box of shape (3,), float32, with the true bounds."""
        high = np.array([MAX_SPEED + 1.0, 12.0, np.pi], dtype=np.float32)
        low = np.array([0.0, -12.0, -np.pi], dtype=np.float32)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self) -> np.ndarray:
        """Return the present state."""
        if self.env.vehicle is None:
            return np.zeros(3, dtype=np.float32)
        ego = cast(EgoCar, self.env.vehicle)
        return np.array([ego.speed, ego.acceleration, ego.yaw_rate], dtype=np.float32)


ACTIONS = {"ContinuousDemand": ContinuousDemand, "DiscreteDemand": DiscreteDemand}


def make_action(env: "BrakingEnv", config: dict[str, Any]) -> ActionType:
    """Return the action type that `config["action"]` names, with its own keys checked."""
    arguments = dict(config)
    name = arguments.pop("type", None)
    if name not in ACTIONS:
        raise unknown_name("action type", name, ACTIONS)
    known = {"levels"} if name == "DiscreteDemand" else set()
    check_keys(f"key of config['action'] for {name}", arguments, known)
    return ACTIONS[name](env, **arguments)
