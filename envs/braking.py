"""`BrakingEnv`: one highway-env environment for every braking scenario."""

from dataclasses import asdict, fields
from math import cos, sin
from typing import Any, ClassVar, cast

import numpy as np
from highway_env.envs.common.abstract import AbstractEnv
from highway_env.road.road import RoadNetwork

from lgmd_gym.envs import surrogate_safety as measures
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.dynamics.path import Path, Pose
from lgmd_gym.envs.dynamics.speed_profile import SpeedProfile
from lgmd_gym.envs.reward import RewardParams, step_reward
from lgmd_gym.envs.scenarios.scenario import EGO_LENGTH, LANE_WIDTH, RoadPlan, Scenario
from lgmd_gym.envs.simulation.network import build_network
from lgmd_gym.envs.simulation.road import BrakingRoad
from lgmd_gym.envs.simulation.vehicles import KINDS, EgoCar
from lgmd_gym.envs.spaces import EgoState, make_action
from lgmd_gym.envs.undefined import UNDEFINED
from lgmd_gym.errors import check_keys

SHADES = (30, 220)  # range from which a target's body grey is drawn
START_SPREAD = 500.0  # [m] of road over which the start is drawn, so that the asphalt differs by seed
PASSED = 2.0  # [m] behind the ego's rear at which an actor counts as passed


class BrakingEnv(AbstractEnv):
    """A car drives its script; the agent may add braking (and throttle, if the config allows).

    ## Description

    The ego follows a scripted path and speed; so do all others. Cars move exactly under piecewise linear
    acceleration and never reverse, and contact is found inside the step, with the speeds of that moment. The
    scene is fixed by the scenario; the seed draws where on the road it starts (so which asphalt is seen) and
    the body grey of every actor whose `shade` is None. Physics runs at 60 Hz, decisions at 30 Hz.

    ## Action Space

    `Box(-1, 1, (1,), float32)`, a longitudinal demand: −1 full brake, 0 hold the scripted speed, +1 full
    throttle (counts only with `config={"throttle": True}`). With
    `config={"action": {"type": "DiscreteDemand", "levels": [0.0, -1.0]}}` an index into the levels. A demand
    waits out one camera frame of latency and the brake's dead time, then the deceleration builds up.

    ## Observation Space

    `Box((3,), float32)`: own speed [m/s], acceleration [m/s²], yaw rate [rad/s, + right]. The registered ids
    put `LGMDObservation` around it.

    ## Rewards

    Per decision of dt: progress dt · v / v_script; less jerk 0.05 · |Δa| / a_max; less needless braking
    2 · dt · a / a_max while no contact is within 4 s; at contact less 10 and 10 · (v_rel / v_script)². So
    contact weighs with the impact energy and costs more than any braking, and standing still earns nothing.
    Weights are in `config["reward"]` (`RewardParams`).

    ## Episode End

    Terminated: contact; the ego at a standstill the script did not want; the ego slower than what it was
    closing on, whose script has ended (Euro NCAP AEB C2C v4.3.1, 8.4.3); everybody passed. Truncated: the
    scenario's duration.

    ## Info

    `ego_speed`, `gap`, `ttc`, `thw`, `drac`, `required_deceleration`, `collision`, `impact_speed`,
    `relative_impact_speed`, `deceleration` (beyond the script), `target_speed`, and highway-env's `speed`
    and `crashed`; SI units, NaN where undefined, definitions in `lgmd_gym.envs.surrogate_safety`.

    ## Arguments

    Args:
        scenario: What happens.
        config: In highway-env's way; unknown keys are refused. Beside highway-env's own keys: those of
            `BrakeParams`, `throttle` (whether demands above 0 count) and `reward` (fields of `RewardParams`).
        render_mode: None, "rgb_array" or "human" (highway-env's top view).

    Raises:
        ValueError: For an unknown key or a value out of its range.

    ## Version History

    v0: may change until 0.1.0 is tagged, never after.

    ## References

    Euro NCAP AEB Car-to-Car v4.3.1; UN R152 Rev.2; 49 CFR 571.127; GB 39901-2025.
    """

    road: BrakingRoad
    # highway-env writes render_fps into a dict that all its classes and instances share.
    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"]}

    def __init__(
        self, scenario: Scenario, config: dict[str, Any] | None = None, render_mode: str | None = None
    ) -> None:
        self.scenario = scenario
        self.camera_fields: dict[str, Any] = {}
        self.metadata = {**type(self).metadata}  # type: ignore[misc]
        self._network: tuple[RoadPlan, RoadNetwork] | None = None
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
        """Build the scene from the environment's own random numbers."""
        self._build(self.np_random)

    def _build(self, rng: np.random.Generator) -> None:
        """Build the scene: the road and its cars are new, a straight network stays."""
        scenario = self.scenario
        start = Pose(float(rng.uniform(0.0, START_SPREAD)), scenario.road.ego_lane * LANE_WIDTH, 0.0)
        if self._network is None or self._network[0] != scenario.road or scenario.road.placed:
            self._network = scenario.road, build_network(scenario.road, start)
        road = BrakingRoad(self._network[1], rng)
        script = SpeedProfile(scenario.ego_speed, scenario.ego_profile)
        ego = EgoCar(road, Path(start, scenario.ego_path), script, self._brake, self.config["throttle"])
        road.vehicles.append(ego)
        for actor in scenario.actors:
            drawn = int(rng.integers(*SHADES, endpoint=True))
            shade = drawn if actor.shade is None else int(actor.shade)
            centre = start.x + EGO_LENGTH / 2 + actor.gap + actor.length / 2
            pose = Pose(centre, start.y - actor.lateral_offset, -actor.heading)
            road.add(KINDS[actor.kind](road, Path(pose, actor.path), actor, shade))
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
        if self.road.contact is not None:
            return True
        if ego.speed == 0.0:
            return ego.script.speed > 0.0
        obstacles = self.road.obstacles
        if not obstacles:
            return False
        before_us = [item for item in obstacles if not self._is_passed(item)]
        self._closed_in = self._closed_in or any(ego.speed > item.speed for item in before_us)
        slower = all(item.settled and item.path.straight and ego.speed < item.speed for item in before_us)
        return not before_us or (self._closed_in and slower)

    def _is_passed(self, item: Any) -> bool:
        """Whether something lies behind the ego's rear, and cannot catch up."""
        ego = self.ego
        dx, dy = item.position[0] - ego.position[0], item.position[1] - ego.position[1]
        behind = -(dx * cos(ego.heading) + dy * sin(ego.heading)) - (ego.LENGTH + item.LENGTH) / 2
        return behind > PASSED and item.speed <= ego.speed

    def _is_truncated(self) -> bool:
        return self.time >= self.scenario.duration - 1e-9

    def _info(self, obs: Any, action: Any = None) -> dict[str, Any]:
        """Return the ground truth; the draw from the unseeded action space at reset is left out."""
        ego, road = self.ego, self.road
        contact, obstacles = road.contact, road.obstacles
        front = measures.ahead(ego, obstacles)
        return {
            "speed": float(ego.speed),
            "crashed": bool(ego.crashed),
            "ego_speed": float(ego.speed),
            "gap": front.gap if front else UNDEFINED,
            "ttc": measures.time_to_contact(ego, obstacles),
            "thw": measures.headway(ego, front),
            "drac": measures.deceleration_to_avoid_crash(ego, front),
            "required_deceleration": measures.required_deceleration(ego, front),
            "collision": contact is not None,
            "impact_speed": contact.impact_speed if contact else UNDEFINED,
            "relative_impact_speed": contact.relative_impact_speed if contact else UNDEFINED,
            "deceleration": ego.braking,
            "target_speed": float(obstacles[0].speed) if obstacles else UNDEFINED,
        }
