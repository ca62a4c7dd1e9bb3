"""What the kinds of traffic have in common: an IDM driver at the wheel, and an agent that may brake."""

from dataclasses import asdict, fields
from functools import partial
from math import cos
from typing import Any, ClassVar, cast

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.abstract import AbstractEnv

from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.spaces import ContinuousDemand, EgoState
from lgmd_gym.envs.traffic.ego import TrafficEgo
from lgmd_gym.envs.traffic.geometry import ahead, time_to_contact
from lgmd_gym.envs.traffic.road import TrafficRoad
from lgmd_gym.envs.undefined import UNDEFINED
from lgmd_gym.errors import check_keys

# [s] below a speed [m/s] after which a drive is over: where ways cross, drivers can block each other.
JAM, WALK = 10.0, 0.5
CLEAR = 12.0  # [m] between centres below which a car is not let in at the start


class TrafficDemand(ContinuousDemand):
    """One number in [-1, 0]: −1 full brake, 0 (and above) leave it to the driver."""

    def space(self) -> spaces.Box:
        """Return Box(-1, 0, (1,), float32)."""
        return spaces.Box(-1.0, 0.0, shape=(1,), dtype=np.float32)

    @property
    def vehicle_class(self) -> Any:
        """What makes the car that takes the demand."""
        return partial(TrafficEgo, brake=cast(TrafficEnv, self.env).brake)


class TrafficState(EgoState):
    """What a car's own sensors tell: speed [m/s], acceleration [m/s²], yaw rate [rad/s, + right]."""

    def space(self) -> spaces.Box:
        """Return a Box of shape (3,), float32; a car can turn on the spot by up to a full steering lock."""
        high = np.array([100.0, 12.0, 10.0 * np.pi], dtype=np.float32)
        low = np.array([0.0, -12.0, -10.0 * np.pi], dtype=np.float32)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self) -> np.ndarray:
        """Return the present state, shape (3,)."""
        if self.env.vehicle is None:
            return np.zeros(3, dtype=np.float32)
        ego = cast(TrafficEgo, self.env.vehicle)
        return np.array([ego.speed, ego.now, ego.yaw_rate], dtype=np.float32)


class TrafficEnv(AbstractEnv):
    """A drive through seeded traffic; mixed in before one of highway-env's own environments.

    The road and the cars are highway-env's. The ego keeps its lane or route, driven by IDM; the action can
    only add braking, through the same brake as in `BrakingEnv`. No traffic ends because of the agent: it
    ends with the ego's first touch, in a jam, at the end of the road or of the time.

    The reward is −1 at the ego's first touch, else minus the braking beyond the driver's in full brakes·s.

    Args:
        config: In highway-env's way; unknown keys are refused. Beside the environment's own keys: those of
            `BrakeParams`. `simulation_frequency` and `policy_frequency` are 30 Hz: the cars decide at each
            step, which in highway-env's own setting comes 15 times a second.
        render_mode: None, "rgb_array" or "human" (highway-env's view from above).

    Raises:
        ValueError: For an unknown key or a value out of its range.
    """

    road: TrafficRoad
    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"]}
    regulated: ClassVar[bool] = False
    warm_up: ClassVar[float] = 4.0  # [s] before the drive begins
    settings: ClassVar[dict[str, Any]] = {}

    def __init__(self, config: dict[str, Any] | None = None, render_mode: str | None = None) -> None:
        self.metadata = {**type(self).metadata}  # type: ignore[misc]
        super().__init__(config=config, render_mode=render_mode)  # type: ignore[arg-type]

    @classmethod
    def default_config(cls) -> dict[str, Any]:
        """Return the default configuration."""
        config = super().default_config()
        config.update(
            {
                "observation": {"type": "TrafficState"},
                "action": {"type": "TrafficDemand"},
                "other_vehicles_type": "lgmd_gym.envs.traffic.drivers.TrafficCar",
                "simulation_frequency": 30,
                "policy_frequency": 30,
                "duration": 60,
                # Without it drivers see nobody beyond the end of their own piece of lane.
                "neighbour_vehicles_connected_lanes": True,
                **asdict(BrakeParams()),
                **cls.settings,
            }
        )
        return config

    def configure(self, config: dict[str, Any] | None) -> None:
        """Take over a configuration, refusing what highway-env would swallow."""
        config = dict(config or {})
        check_keys("config key", config, self.config)
        super().configure(config)
        self.brake = BrakeParams(**{f.name: self.config[f.name] for f in fields(BrakeParams)})
        simulation, policy = self.config["simulation_frequency"], self.config["policy_frequency"]
        if policy <= 0 or simulation % policy:
            raise ValueError(
                f"policy_frequency {policy} Hz does not divide simulation_frequency {simulation} Hz; "
                "choose one that does, such as 30 under 30"
            )

    def define_spaces(self) -> None:
        """Set the action and observation types and their spaces."""
        self.observation_type, self.action_type = TrafficState(self), TrafficDemand(self)
        self.observation_space = self.observation_type.space()
        self.action_space = self.action_type.space()

    @property
    def ego(self) -> TrafficEgo:
        """The car under test."""
        return cast(TrafficEgo, self.vehicle)

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance by one decision; see `AbstractEnv.step`."""
        # Not the host's own step: IntersectionEnv lets in a new car with each decision.
        return AbstractEnv.step(self, action)

    def coast(self) -> None:
        """Advance by one decision under the demands made so far, without looking: no observation, no info."""
        self.time += 1 / self.config["policy_frequency"]
        self._simulate(None)

    def _simulate(self, action: Any = None) -> None:
        super()._simulate(action)
        self._standing = self._standing + 1 if self.ego.speed < WALK else 0
        if self.road.touch is None:
            self._exchange()

    def _exchange(self) -> None:
        """Let cars leave and enter after a decision."""

    def _reset(self) -> None:
        """Build the scene and let it run until gaps and speeds fit each other."""
        while True:  # a warm-up in which the ego touches somebody is drawn again
            self._standing = 0
            self._build()
            for _ in range(round(self.warm_up * self.config["policy_frequency"])):
                self._simulate(None)
            if self.road.touch is None:
                break
        self.ego.travelled = 0.0
        self.steps = self._standing = 0

    def _build(self) -> None:
        super()._reset()
        self.road = TrafficRoad(self.road, self.ego, self.regulated)
        self._settle()
        kept: list[Any] = [self.ego]
        for car in self.road.cars:
            if car is not self.ego and all(_apart(car, other) > CLEAR for other in kept):
                kept.append(car)
            limit = float(car.lane.speed_limit)
            # A start beyond the limit would begin every drive with an emergency brake down to it.
            car.speed, car.target_speed = min(car.speed, limit), min(car.target_speed, limit)
        self.road.cars[:] = kept

    def _settle(self) -> None:
        """Change highway-env's scene: more cars, other speeds."""

    def _is_finished(self) -> bool:
        """Return whether the ego has come to the end of the road."""
        return False

    def _reward(self, action: Any) -> float:
        if self.road.touch is not None:
            return -1.0
        return -self.ego.braking / self.brake.max_deceleration / self.config["policy_frequency"]

    def _rewards(self, action: Any) -> dict[str, float]:
        raise NotImplementedError

    def _is_terminated(self) -> bool:
        return self.road.touch is not None or self._is_finished()

    def _is_truncated(self) -> bool:
        jammed = self._standing >= JAM * self.config["policy_frequency"]
        return jammed or self.time >= self.config["duration"] - 1e-9

    def _info(self, obs: Any, action: Any = None) -> dict[str, Any]:
        """Return the ground truth, with the names of `BrakingEnv`, and what the driver does."""
        ego, touch = self.ego, self.road.touch
        others = self.road.others
        front, ttc = ahead(ego, others), time_to_contact(ego, others)
        return {
            "speed": float(ego.speed),
            "crashed": bool(ego.crashed),
            "ego_speed": float(ego.speed),
            "gap": front[0] if front else UNDEFINED,
            "ttc": UNDEFINED if ttc is None else ttc,
            "collision": touch is not None,
            "side": touch.side if touch else "",
            "impact_speed": touch.impact_speed if touch else UNDEFINED,
            "relative_impact_speed": touch.relative_impact_speed if touch else UNDEFINED,
            "deceleration": ego.braking,
            "driver_acceleration": ego.driver,
            "target_speed": _speed_along(ego, front[1]) if front else UNDEFINED,
            "distance": ego.travelled,
        }


def _apart(one: Any, other: Any) -> float:
    return float(np.hypot(*(one.position - other.position)))


def _speed_along(ego: TrafficEgo, other: Any) -> float:
    """Return another's speed along the ego's heading [m/s]."""
    return float(other.speed * cos(float(other.heading) - ego.heading))
