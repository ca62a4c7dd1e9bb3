"""`BrakingEnv`: the highway-env environment of all braking scenarios."""

from dataclasses import asdict
from math import cos, inf, sin
from typing import Any, cast

import numpy as np
from highway_env.road.road import RoadNetwork

from lgmd_gym.envs import surrogate_safety
from lgmd_gym.envs.base import EgoBrakeEnv
from lgmd_gym.envs.dynamics.path import Path, Pose
from lgmd_gym.envs.dynamics.speed_profile import SpeedProfile
from lgmd_gym.envs.reward import RewardParams, step_reward
from lgmd_gym.envs.scenarios.scenario import EGO_LENGTH, LANE_WIDTH, RoadPlan, Scenario
from lgmd_gym.envs.simulation.network import build_network
from lgmd_gym.envs.simulation.road import BrakingRoad
from lgmd_gym.envs.simulation.vehicles import ACTOR_CLASSES, EgoCar
from lgmd_gym.envs.spaces import EgoState, make_action
from lgmd_gym.errors import check_keys

SHADES = (30, 220)  # range of random grey levels
START_RANGE = 500.0  # [m], range of the random start position, which varies the road texture
PASSED_DISTANCE = 2.0  # [m] behind the ego's rear beyond which an actor has been passed


class BrakingEnv(EgoBrakeEnv):
    """A car follows a scripted path and speed; the agent can brake.

    ## Description

    The ego and all actors follow scripted paths and speeds. Cars move exactly under piecewise linear
    acceleration and never reverse. Contact is detected inside the step, with the speeds of that moment. The
    scenario fixes the scene; the seed draws the start position on the road (which varies the visible road
    texture) and the grey level of every actor whose `shade` is None. Physics runs at 60 Hz, decisions at
    30 Hz.

    ## Action Space

    `Box(-1, 1, (1,), float32)`, a longitudinal demand: −1 full brake, 0 hold the scripted speed, +1 full
    throttle (only with `config={"throttle": True}`). With
    `config={"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}}` the action is an index into
    `demands`. The deceleration builds up after one camera frame of latency and the dead time of the brake.

    ## Observation Space

    `Box((3,), float32)`: ego speed [m/s], acceleration [m/s²], yaw rate [rad/s, + right]. The registered ids
    wrap the environment in `LGMDObservation`.

    ## Rewards

    The reward of a decision of duration dt is the sum of these terms, with the weights of `config["reward"]`:

    | term | default weight | value |
    |---|---|---|
    | progress | `progress` = 1 | + dt · min(v / v_script, 1), with the mean speed v of the decision |
    | jerk | `jerk` = 0.05 | − abs(Δa) / a_max |
    | needless braking | `brake` = 2 | − dt · a / a_max, unless a contact is less than `need_ttc` = 4 s away |
    | contact | `contact` = 10 | − 1 |
    | impact | `impact` = 10 | − (v_rel / v_script)², with the relative impact speed v_rel |

    Here v_script is the highest scripted ego speed, a the deceleration beyond the script, Δa the change of
    the ego's acceleration, and a_max = `max_deceleration`. A contact costs more than any braking, and
    standing still earns nothing.

    ## Episode End

    Terminated: at contact; when the ego reaches a standstill that is not scripted; when the ego has become
    slower than all actors ahead of it after having closed in on one, and their scripts have ended (Euro NCAP
    AEB C2C v4.3.1, 8.4.3); when the ego has passed all actors. Truncated: after the scenario's duration.

    ## Info

    Undefined values are `inf` in `info` and null in benchmark rows. Definitions are in
    `lgmd_gym.envs.surrogate_safety`.

    | key | meaning | undefined |
    |---|---|---|
    | `ego_speed`, `speed` | ego speed [m/s] | |
    | `deceleration` | ego deceleration beyond the script, >= 0 [m/s²] | |
    | `gap` | free distance along the ego's path, from the front bumper [m] | nothing within 300 m |
    | `ttc` | time to contact at constant speeds and paths [s] | no contact within 10 s |
    | `thw` | time headway gap / v [s] | nothing ahead, or standstill |
    | `drac` | deceleration rate to avoid a crash Δv² / (2·gap) [m/s²] | nothing ahead, or contact |
    | `required_deceleration` | DRAC minus the lead's acceleration, >= 0 [m/s²] | nothing ahead, or contact |
    | `target_speed` | speed of the first actor [m/s] | no solid actor |
    | `collision`, `crashed` | whether the ego has had contact | |
    | `impact_speed` | ego speed at contact [m/s] | no contact |
    | `relative_impact_speed` | the same minus the other's speed along the ego's heading [m/s] | no contact |

    ## Arguments

    Args:
        scenario: The scenario.
        config: highway-env's configuration keys; the fields of `BrakeParams`; `throttle`, whether demands
            above 0 have an effect (False); `action`, see Action Space; `reward`, fields of `RewardParams`.
            Defaults of `simulation_frequency` and `policy_frequency`: 60 and 30 Hz.
        render_mode: None, "rgb_array" or "human" (highway-env's top view).

    Raises:
        ValueError: If a configuration key is unknown or a value is out of range.

    ## Version History

    v0: may change until release 0.1.0.

    ## References

    Euro NCAP AEB Car-to-Car v4.3.1; UN R152 Rev.2; 49 CFR 571.127; GB 39901-2025.
    """

    road: BrakingRoad

    def __init__(
        self, scenario: Scenario, config: dict[str, Any] | None = None, render_mode: str | None = None
    ) -> None:
        self.scenario = scenario
        self.camera_fields: dict[str, Any] = {}
        self._network: tuple[RoadPlan, RoadNetwork] | None = None
        self._closed_in = False
        super().__init__(config, render_mode)

    @classmethod
    def default_config(cls) -> dict[str, Any]:
        """Return the default configuration."""
        return super().default_config() | {
            "observation": {"type": "EgoState"},
            "action": {"type": "ContinuousDemand"},
            "simulation_frequency": 60,
            "throttle": False,
            "reward": asdict(RewardParams()),
        }

    def configure(self, config: dict[str, Any] | None) -> None:
        """Apply a configuration.

        Raises:
            ValueError: If a key is unknown or a value is out of range.
        """
        config = dict(config or {})
        reward = config.pop("reward", {})
        check_keys("key of config['reward']", reward, self.config["reward"])
        super().configure(config)
        self.config["reward"] = {**self.config["reward"], **reward}
        self._reward_params = RewardParams(**self.config["reward"])

    def define_spaces(self) -> None:
        """Set the action and observation types and their spaces."""
        check_keys("observation type", [self.config["observation"].get("type")], ["EgoState"])
        self.observation_type = EgoState(self)
        self.action_type = make_action(self, self.config["action"])
        self.observation_space = self.observation_type.space()
        self.action_space = self.action_type.space()

    def update_metadata(self, video_real_time_ratio: int = 1) -> None:
        """Set `render_fps` so that videos play in real time."""
        super().update_metadata(video_real_time_ratio)

    @property
    def ego(self) -> EgoCar:
        """The car under test."""
        return cast(EgoCar, self.vehicle)

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Advance by one decision; see `AbstractEnv.step`."""
        self._motion_before = self.ego.speed, self.ego.acceleration
        return super().step(action)

    def _reset(self) -> None:
        self._build(self.np_random)

    def _build(self, rng: np.random.Generator) -> None:
        """Build the scene; straight road networks are reused between episodes."""
        scenario = self.scenario
        start = Pose(float(rng.uniform(0.0, START_RANGE)), scenario.road.ego_lane * LANE_WIDTH, 0.0)
        if self._network is None or self._network[0] != scenario.road or scenario.road.relative_to_ego:
            self._network = scenario.road, build_network(scenario.road, start)
        road = BrakingRoad(self._network[1], rng)
        script = SpeedProfile(scenario.ego_speed, scenario.ego_profile)
        ego = EgoCar(road, Path(start, scenario.ego_path), script, self.brake, self.config["throttle"])
        road.vehicles.append(ego)
        for actor in scenario.actors:
            drawn = int(rng.integers(*SHADES, endpoint=True))
            shade = drawn if actor.shade is None else int(actor.shade)
            centre = start.x + EGO_LENGTH / 2 + actor.gap + actor.length / 2
            pose = Pose(centre, start.y - actor.lateral_offset, -actor.heading)
            road.add(ACTOR_CLASSES[actor.kind](road, Path(pose, actor.path), actor, shade))
        road.ego = ego
        self.road, self.controlled_vehicles = road, [ego]
        self._motion_before = ego.speed, ego.acceleration
        self._closed_in = False

    def _reward(self, action: Any) -> float:
        return step_reward(self, self._reward_params, *self._motion_before)

    def _is_terminated(self) -> bool:
        ego = self.ego
        if self.road.contact is not None:
            return True
        if ego.speed == 0.0:
            return ego.script.speed > 0.0
        obstacles = self.road.obstacles
        if not obstacles:
            return False
        remaining = [item for item in obstacles if not self._is_passed(item)]
        self._closed_in = self._closed_in or any(ego.speed > item.speed for item in remaining)
        resolved = all(
            item.script.finished and item.path.straight and ego.speed < item.speed for item in remaining
        )
        return not remaining or (self._closed_in and resolved)

    def _is_passed(self, item: Any) -> bool:
        """Return whether an obstacle is behind the ego's rear and not faster than the ego."""
        ego = self.ego
        dx, dy = item.position[0] - ego.position[0], item.position[1] - ego.position[1]
        behind = -(dx * cos(ego.heading) + dy * sin(ego.heading)) - (ego.LENGTH + item.LENGTH) / 2
        return behind > PASSED_DISTANCE and item.speed <= ego.speed

    def _is_truncated(self) -> bool:
        return self.time >= self.scenario.duration - 1e-9

    def _info(self, obs: Any, action: Any = None) -> dict[str, Any]:
        ego, contact, obstacles = self.ego, self.road.contact, self.road.obstacles
        lead = surrogate_safety.find_lead(ego, obstacles)
        return {
            "speed": float(ego.speed),
            "crashed": bool(ego.crashed),
            "ego_speed": float(ego.speed),
            "gap": lead.gap if lead else inf,
            "ttc": surrogate_safety.time_to_contact(ego, obstacles),
            "thw": surrogate_safety.time_headway(ego, lead),
            "drac": surrogate_safety.deceleration_to_avoid_crash(ego, lead),
            "required_deceleration": surrogate_safety.required_deceleration(ego, lead),
            "collision": contact is not None,
            "impact_speed": contact.impact_speed if contact else inf,
            "relative_impact_speed": contact.relative_impact_speed if contact else inf,
            "deceleration": ego.braking,
            "target_speed": float(obstacles[0].speed) if obstacles else inf,
        }
