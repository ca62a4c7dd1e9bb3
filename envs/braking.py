"""`BrakingEnv`: one highway-env environment for every braking scenario."""

from dataclasses import asdict, fields
from typing import Any, ClassVar, cast

import numpy as np
from highway_env.envs.common.abstract import AbstractEnv

from lgmd_gym.envs import measures
from lgmd_gym.envs.brake import BrakeParams
from lgmd_gym.envs.interface import EgoState, make_action
from lgmd_gym.envs.reward import RewardParams, step_reward
from lgmd_gym.envs.road import BrakingRoad, straight_network
from lgmd_gym.envs.scenario import EGO_LENGTH, LANE_WIDTH, Scenario
from lgmd_gym.envs.undefined import UNDEFINED
from lgmd_gym.envs.vehicles import EgoCar, ScriptedCar
from lgmd_gym.errors import check_keys

SHADES = (30, 220)  # range from which a target's body grey is drawn
START_SPREAD = 500.0  # [m] of road over which the start is drawn, so that the asphalt differs by seed
PASSED = 2.0  # [m] behind the ego's rear at which an actor counts as passed
FREE = ("observation", "action", "screen_width", "screen_height", "scaling", "centering_position")


class BrakingEnv(AbstractEnv):
    """A car drives its script; the agent may add braking (and throttle, if the config allows).

    The scene is fixed by the scenario; the seed draws where on the road it starts (so which asphalt is seen)
    and the body grey of every actor whose `shade` is None.

    Args:
        scenario: What happens.
        config: In highway-env's way; unknown keys are refused. Beside highway-env's own keys: those of
            `BrakeParams`, `throttle` (whether demands above 0 count) and `reward` (fields of `RewardParams`).
        render_mode: None, "rgb_array" or "human" (highway-env's top view).

    Raises:
        ValueError: For an unknown key or a value out of its range.
    """

    road: BrakingRoad
    # highway-env writes render_fps into a dict that all its classes and instances share.
    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"]}

    def __init__(
        self, scenario: Scenario, config: dict[str, Any] | None = None, render_mode: str | None = None
    ) -> None:
        self.scenario = scenario
        self.metadata = {**type(self).metadata}  # type: ignore[misc]
        self._network = straight_network(scenario.lanes)
        self._closed_in = False
        super().__init__(config=config, render_mode=render_mode)  # type: ignore[arg-type]

    @classmethod
    def default_config(cls) -> dict[str, Any]:
        """Return the default configuration."""
        config = super().default_config()
        config.update(
            {
                "observation": {"type": "EgoState"},
                "action": {"type": "ContinuousDemand"},
                "simulation_frequency": 60,
                "policy_frequency": 30,
                "throttle": False,
                "reward": asdict(RewardParams()),
                **asdict(BrakeParams()),
            }
        )
        return config

    def configure(self, config: dict[str, Any] | None) -> None:
        """Take over a configuration, refusing what highway-env would swallow."""
        config = dict(config or {})
        check_keys("config key", config, self.config)
        reward = config.pop("reward", {})
        check_keys("key of config['reward']", reward, self.config["reward"])
        super().configure(config)
        self.config["reward"] = {**self.config["reward"], **reward}
        self._brake = BrakeParams(**{f.name: self.config[f.name] for f in fields(BrakeParams)})
        self._reward_params = RewardParams(**self.config["reward"])
        simulation, policy = self.config["simulation_frequency"], self.config["policy_frequency"]
        if policy <= 0 or simulation % policy:
            raise ValueError(
                f"policy_frequency {policy} Hz does not divide simulation_frequency {simulation} Hz; "
                "choose one that does, such as 30 under 60"
            )

    def define_spaces(self) -> None:
        """Set the action and observation types and their spaces."""
        check_keys("observation type", [self.config["observation"].get("type")], ["EgoState"])
        self.observation_type = EgoState(self)
        self.action_type = make_action(self, self.config["action"])
        self.observation_space = self.observation_type.space()
        self.action_space = self.action_type.space()

    def update_metadata(self, video_real_time_ratio: int = 1) -> None:
        """Set `render_fps` to real time."""
        super().update_metadata(video_real_time_ratio)

    @property
    def ego(self) -> EgoCar:
        """The car under test."""
        return cast(EgoCar, self.vehicle)

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance by one decision; see `AbstractEnv.step`."""
        self._before = self.ego.speed, self.ego.acceleration
        return super().step(action)

    def _reset(self) -> None:
        """Build the scene: the network stays, the road and its cars are new."""
        scenario = self.scenario
        road = BrakingRoad(self._network, self.np_random)
        x = float(self.np_random.uniform(0.0, START_SPREAD))
        y = scenario.ego_lane * LANE_WIDTH
        ego = EgoCar(road, (x, y), scenario.ego_speed, self._brake, self.config["throttle"])
        road.vehicles.append(ego)
        for actor in scenario.actors:
            drawn = int(self.np_random.integers(*SHADES, endpoint=True))
            shade = drawn if actor.shade is None else int(actor.shade)
            centre = x + EGO_LENGTH / 2 + actor.gap + actor.length / 2
            road.vehicles.append(ScriptedCar(road, (centre, y - actor.lateral_offset), actor, shade))
        road.ego = ego
        self.road, self.controlled_vehicles = road, [ego]
        self._before = ego.speed, ego.acceleration
        self._closed_in = False

    def _reward(self, action: Any) -> float:
        return step_reward(self, self._reward_params, *self._before)

    def _is_terminated(self) -> bool:
        """Contact, standstill, a closing car no longer closing, or everybody passed.

        Euro NCAP AEB C2C v4.3.1, 8.4.3, ends a run once the ego is slower than the target; here only after it
        had been faster (a car that follows at constant distance is not saved by braking) and once the
        target's script has nothing left to change.
        """
        ego = self.ego
        if self.road.contact is not None or ego.speed == 0.0:
            return True
        cars = measures.others(ego, self.road.vehicles)
        if not cars:
            return False
        ahead = [car for car in cars if not self._is_passed(car)]
        self._closed_in = self._closed_in or any(ego.speed > car.speed for car in ahead)
        slower = all(isinstance(car, ScriptedCar) and car.settled and ego.speed < car.speed for car in ahead)
        return not ahead or (self._closed_in and slower)

    def _is_passed(self, car: Any) -> bool:
        ego = self.ego
        behind = (ego.position[0] - ego.LENGTH / 2) - (car.position[0] + car.LENGTH / 2)
        return behind > PASSED and car.speed <= ego.speed

    def _is_truncated(self) -> bool:
        return self.time >= self.scenario.duration - 1e-9

    def _info(self, obs: Any, action: Any = None) -> dict[str, Any]:
        """Return the ground truth; the draw from the unseeded action space at reset is left out."""
        ego, road = self.ego, self.road
        contact = road.contact
        return {
            "speed": float(ego.speed),
            "crashed": bool(ego.crashed),
            "ego_speed": float(ego.speed),
            "gap": measures.gap(ego, road.vehicles),
            "ttc": measures.time_to_contact(ego, road.vehicles),
            "collision": contact is not None,
            "impact_speed": contact.impact_speed if contact else UNDEFINED,
            "relative_impact_speed": contact.relative_impact_speed if contact else UNDEFINED,
            "deceleration": ego.braking,
            "target_speed": float(road.vehicles[1].speed) if len(road.vehicles) > 1 else UNDEFINED,
        }
