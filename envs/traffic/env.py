# pyright: standard
# Not strict: highway-env states few types.
"""`TrafficEnv`: base of the traffic environments, with an IDM driver and an agent that can brake."""

from collections.abc import Callable
from functools import partial
from math import cos, inf
from typing import ClassVar, cast

import numpy as np
from gymnasium import spaces
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.envs.common.action import Action

from lgmd_gym.aliases import Config, Info
from lgmd_gym.camera.scene import Scene
from lgmd_gym.envs import surrogate_safety
from lgmd_gym.envs.appearance import Appearance, brake_of
from lgmd_gym.envs.attention import Attention
from lgmd_gym.envs.base import EgoBrakeEnv
from lgmd_gym.envs.spaces import ContinuousDemand, DiscreteDemand, EgoState, make_action
from lgmd_gym.envs.surrogate_safety import required_deceleration
from lgmd_gym.envs.traffic.cars import TrafficCar, TrafficEgo
from lgmd_gym.envs.traffic.driver_errors import DriverErrors, add_follower
from lgmd_gym.envs.traffic.road import TrafficRoad

JAM_TIME, JAM_SPEED = 10.0, 0.5  # [s], [m/s]: the episode ends after this time below this speed
MIN_START_DISTANCE = 12.0  # [m] between the centres of two cars at the start
_NO_PATHS = np.zeros((1, 6))  # all cars move straight on


class TrafficDemand(ContinuousDemand):
    """A longitudinal demand in [-1, 0]: −1 full brake, 0 and above no braking beyond the driver's."""

    def space(self) -> spaces.Space:
        """Return Box(-1, 0, (1,), float32)."""
        return spaces.Box(-1.0, 0.0, shape=(1,), dtype=np.float32)

    @property
    def vehicle_class(self) -> Callable[..., TrafficEgo]:
        """Factory of the controlled car."""
        return partial(TrafficEgo, brake=cast(TrafficEnv, self.env).brake)


class DiscreteTrafficDemand(DiscreteDemand, TrafficDemand):
    """An index into a list of longitudinal demands; those above 0 have the effect of 0."""


ACTIONS = {"TrafficDemand": TrafficDemand, "DiscreteDemand": DiscreteTrafficDemand}


class TrafficState(EgoState):
    """Ego speed [m/s], acceleration [m/s²] and yaw rate [rad/s, + right]."""

    def space(self) -> spaces.Space:
        """Return a float32 Box of shape (3,); the yaw rate is bounded by the full steering lock."""
        high = np.array([100.0, 12.0, 10.0 * np.pi], dtype=np.float32)
        low = np.array([0.0, -12.0, -10.0 * np.pi], dtype=np.float32)
        return spaces.Box(low, high, dtype=np.float32)

    def observe(self) -> np.ndarray:
        """Return the current state, float32, shape (3,)."""
        if self.env.vehicle is None:
            return np.zeros(3, dtype=np.float32)
        ego = cast(TrafficEgo, self.env.vehicle)
        return np.array([ego.speed, ego.current_acceleration, ego.yaw_rate], dtype=np.float32)


class TrafficEnv(EgoBrakeEnv):
    """The ego drives through random traffic with an IDM driver; the agent can add braking.

    ## Description

    Roads and cars are highway-env's: subclasses also inherit from one of its environments. The seed draws the
    traffic, and the time headway of each driver, in [0.4, 1.5] s. The ego keeps its lane or route, driven by
    IDM. The demand passes through the brake model of `BrakingEnv`, with the brake of the world; the driver
    brakes no harder than that brake can.

    With `attention="inattentive"` the same traffic has human errors: the ego's driver looks away for 2 to 4 s
    and holds the acceleration, a car ahead brakes now and then, and the driver behind reacts late. The times
    are drawn from the seed at the reset, and are the same whatever an agent does.

    ## Action Space

    `Box(-1, 0, (1,), float32)`, a longitudinal demand: −1 full brake, 0 no braking beyond the driver's.
    `Discrete` with `config["action"]` = `{"type": "DiscreteDemand", "demands": [...]}`: an index into a list
    of demands.

    ## Observation Space

    `Box((3,), float32)`: ego speed [m/s], acceleration [m/s²], yaw rate [rad/s, + right]. The registered ids
    wrap the environment in `LGMDObservation`.

    ## Rewards

    −1 at the ego's first contact; otherwise −dt · a / a_max for a decision of duration dt with a deceleration
    a beyond the driver's.

    ## Episode End

    Terminated: at the ego's first contact or at the end of the road. Truncated: after 10 s below 0.5 m/s, or
    after `config["duration"]` (60 s).

    ## Info

    The keys of `BrakingEnv` except `thw` and `drac`, with these differences; undefined values are `inf`.

    | key | meaning | undefined |
    |---|---|---|
    | `deceleration` | ego deceleration beyond the driver's, >= 0 [m/s²] | |
    | `driver_acceleration` | acceleration demanded by the driver [m/s²] | |
    | `attentive` | whether the driver observes the road, see `attention` | |
    | `required_deceleration` | Δv / (2·t) of contacts predicted with the steering, >= 0 [m/s²] | contact |
    | `target_speed` | speed along the ego's heading of the first car ahead [m/s] | nothing within 300 m |
    | `side` | part of the ego in contact: "front", "rear", "side"; "" without contact | |
    | `distance` | distance travelled since the reset [m] | |
    | `world` | number of the world, −1 for the laboratory | |

    ## Arguments

    Args:
        config: The keys of the highway-env environment and the fields of `BrakeParams`. Defaults of
            `simulation_frequency` and `policy_frequency`: 30 Hz; the other cars decide at every step, as in
            highway-env, where the default is 15 Hz.
        render_mode: None, "rgb_array" or "human" (highway-env's top view).

    Raises:
        ValueError: If a configuration key is unknown or a value is out of range.

    ## Version History

    v0: may change until release 0.1.0.
    """

    road: TrafficRoad
    appearance: Appearance = Appearance()
    """World, weather and road of the next episodes."""
    attention: Attention = Attention()
    """Errors of the drivers in the next episodes."""
    scene: Scene = Scene()
    """Scene of the present episode."""
    regulated: ClassVar[bool] = False
    """Whether cars give way at intersections of their routes (highway-env's rules)."""
    warm_up: ClassVar[float] = 4.0
    """Simulated time before the episode begins [s]."""
    settings: ClassVar[Config] = {}
    """Configuration values that differ from highway-env's environment."""

    @classmethod
    def default_config(cls) -> Config:
        """Return the default configuration."""
        return super().default_config() | {
            "observation": {"type": "TrafficState"},
            "action": {"type": "TrafficDemand"},
            "other_vehicles_type": "lgmd_gym.envs.traffic.cars.TrafficCar",
            "simulation_frequency": 30,
            "duration": 60,
            # Without it, drivers ignore cars beyond the end of their own lane section.
            "neighbour_vehicles_connected_lanes": True,
            **cls.settings,
        }

    def define_spaces(self) -> None:
        """Set the action and observation types and their spaces."""
        self.observation_type = TrafficState(self)
        self.action_type = make_action(self, self.config["action"], ACTIONS)
        self.observation_space = self.observation_type.space()
        self.action_space = self.action_type.space()

    @property
    def ego(self) -> TrafficEgo:
        """The car under test."""
        return cast(TrafficEgo, self.vehicle)

    @property
    def required_deceleration(self) -> float:
        """Deceleration that avoids the predicted contacts [m/s²]; see `need.required_deceleration`."""
        return required_deceleration(self.road.bodies())

    def step(self, action: Action) -> tuple[np.ndarray, float, bool, bool, Info]:
        """Advance by one decision; see `AbstractEnv.step`."""
        # IntersectionEnv.step would add a car at every decision.
        return AbstractEnv.step(self, action)

    def advance(self) -> tuple[Info, bool]:
        """Advance by one decision with the last demand.

        Returns:
            The info, and whether the episode has ended.
        """
        self.step_unobserved()
        return self._info(None), self._is_terminated() or self._is_truncated()

    def step_unobserved(self) -> None:
        """Advance by one decision with the last demand, without computing observation, reward and info."""
        self.time += 1 / self.config["policy_frequency"]
        self._simulate(None)

    def _simulate(self, action: Action | None = None) -> None:
        super()._simulate(action)
        self._jam_steps = self._jam_steps + 1 if self.ego.speed < JAM_SPEED else 0
        if self.road.contact is None:
            self._add_and_remove_cars()

    def _add_and_remove_cars(self) -> None:
        """Add and remove cars after a decision."""

    def _reset(self) -> None:
        """Build the scene and simulate the warm-up; repeat until the warm-up is free of ego contact."""
        # A generator of its own: the draws of the traffic are the same in every world.
        self.scene = self.appearance.draw(self.np_random.spawn(1)[0])
        self.brake = self.episode_brake(brake_of(self.scene))
        # Spawned for inattentive drivers only, whose traffic is otherwise that of attentive ones.
        rng = self.np_random.spawn(1)[0] if self.attention.errs else None
        while True:
            self._jam_steps = 0
            self._build()
            for _ in range(round(self.warm_up * self.config["policy_frequency"])):
                self._simulate(None)
            if self.road.contact is None:
                break
        if rng is not None:
            step = 1 / self.config["simulation_frequency"]
            self.road.errors = DriverErrors(self.attention, rng, self.config["duration"], step)
            if self.attention.follower:
                add_follower(self.road, self.ego, rng)
        self.ego.travelled = 0.0
        self.steps = self._jam_steps = 0

    def _build(self) -> None:
        super()._reset()
        self.road = TrafficRoad(self.road, self.ego, self.regulated)
        self._modify_scene()
        cars: list[TrafficCar] = [self.ego]
        for car in self.road.cars:
            if car is not self.ego and all(_distance(car, other) > MIN_START_DISTANCE for other in cars):
                cars.append(car)
            limit = float(car.lane.speed_limit)
            # An initial speed above the limit would begin every episode with emergency braking.
            car.speed, car.target_speed = min(car.speed, limit), min(car.target_speed, limit)
        self.road.cars[:] = cars

    def _modify_scene(self) -> None:
        """Change highway-env's initial scene: add cars, change speeds."""

    def _is_finished(self) -> bool:
        """Return whether the ego has reached the end of the road."""
        return False

    def _reward(self, action: Action) -> float:
        if self.road.contact is not None:
            return -1.0
        return -self.ego.braking / self.brake.max_deceleration / self.config["policy_frequency"]

    def _rewards(self, action: Action) -> dict[str, float]:
        raise NotImplementedError

    def _is_terminated(self) -> bool:
        return self.road.contact is not None or self._is_finished()

    def _is_truncated(self) -> bool:
        jammed = self._jam_steps >= JAM_TIME * self.config["policy_frequency"]
        return jammed or self.time >= self.config["duration"] - 1e-9

    def _info(self, obs: object, action: object = None) -> Info:
        ego, contact, bodies = self.ego, self.road.contact, self.road.bodies()
        gap, index = surrogate_safety.lead_of(bodies, len(bodies), _NO_PATHS)
        lead = bodies[index]
        return {
            "speed": float(ego.speed),
            "crashed": bool(ego.crashed),
            "ego_speed": float(ego.speed),
            "gap": gap,
            "ttc": surrogate_safety.contact_time(bodies, len(bodies), _NO_PATHS),
            "collision": contact is not None,
            "side": contact.side if contact else "",
            "impact_speed": contact.impact_speed if contact else inf,
            "relative_impact_speed": contact.relative_impact_speed if contact else inf,
            "deceleration": ego.braking,
            "driver_acceleration": ego.driver_acceleration,
            "attentive": self.road.errors is None or self.road.errors.attentive,
            "required_deceleration": required_deceleration(bodies),
            "target_speed": float(lead["speed"] * cos(lead["heading"] - ego.heading)) if index else inf,
            "distance": ego.travelled,
            "world": self.scene.number,
        }


def _distance(one: TrafficCar, other: TrafficCar) -> float:
    return float(np.hypot(*(one.position - other.position)))
