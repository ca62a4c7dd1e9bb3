# pyright: standard
# Not strict: highway-env states few types.
"""`BrakingEnv`: the highway-env environment of all braking scenarios."""

from dataclasses import asdict
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from lgmd_gym.aliases import Config, Info
from lgmd_gym.camera.scene import Scene
from lgmd_gym.envs.base import EgoBrakeEnv
from lgmd_gym.envs.episode_source import EpisodeSource, FixedScenario
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.forecast import ForecastParams
from lgmd_gym.envs.highway.road import BrakingRoad, EgoCar
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.envs.simulation import Rates, Sensors, Simulation
from lgmd_gym.envs.spaces import ContinuousDemand, EgoState, make_action
from lgmd_gym.errors import check_keys, check_mapping, check_within, shown

_SELECTED = np.ones(1, np.bool_)


class BrakingEnv(EgoBrakeEnv):
    """A car follows a scripted path and speed; the agent can brake.

    The environment is highway-env's face of row 0 of a `Simulation` of one environment.

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
    A source of episodes may draw another brake for each episode. Neither the observation nor `info` contains
    the brake or whether the road is wet.

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
    | impact | `impact` = 10 | − min(v_rel / v_script, 1)², with the relative impact speed v_rel |

    Here v_script is the highest scripted ego speed, a the deceleration beyond the script, Δa the change of
    the ego's acceleration, and a_max the `max_deceleration` of the episode's brake. A contact costs more than
    any braking, and standing still earns nothing.

    ## Episode End

    Terminated: at contact; when the ego has passed all actors; and when the conflict has been resolved for
    `follow_up` = 2 s without a break, so that a contact after a release of the brake counts. It is resolved
    while the ego stands without a script that stops it, unless a car or motorcycle is about to touch it, and
    while the ego is slower than all actors ahead of it after having closed in on one, and their scripts have
    ended (Euro NCAP AEB C2C v4.3.1, 8.4.3). Truncated: after the scenario's duration.

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
    | `target_speed` | speed of the first solid actor [m/s] | no solid actor |
    | `collision`, `crashed` | whether the ego has had contact | |
    | `impact_speed` | ego speed at contact [m/s] | no contact |
    | `relative_impact_speed` | the same minus the other's speed along the ego's heading [m/s] | no contact |
    | `world` | number of the world, −1 for the laboratory | |
    | `ttb` | time to brake, for which full braking can wait [s]; only with `forecast` | no contact ahead |
    | `level` | number of the level; only with random levels | |
    | `condition` | name of the weather; only with random levels | |

    ## Arguments

    Args:
        scenario: The scenario, or a source of scenarios.
        config: highway-env's configuration keys; the fields of `BrakeParams`, which take precedence over a
            brake that the source draws; `throttle`, whether demands above 0 have an effect (False); `action`,
            see Action Space; `reward`, fields of `RewardParams`; `follow_up`, in [0, 60] s, see Episode End
            (2); `forecast`, fields of `ForecastParams`, none of which is for no `info["ttb"]`. Defaults of
            `simulation_frequency` and `policy_frequency`: 60 and 30 Hz.
        render_mode: None, "rgb_array" or "human" (highway-env's top view).

    Raises:
        ValueError: If a configuration key is unknown or a value is out of range.

    ## Version History

    v0: may change until release 0.1.0.

    ## References

    Euro NCAP AEB Car-to-Car v4.3.1; UN R152 Rev.2; 49 CFR 571.127; GB 39901-2025.
    """

    road: BrakingRoad
    action_type: ContinuousDemand
    simulation: Simulation
    rendering_paused = False
    """Whether attached cameras draw no frames until the next reset."""

    def __init__(
        self,
        scenario: Scenario | EpisodeSource,
        config: Config | None = None,
        render_mode: str | None = None,
    ) -> None:
        if not isinstance(scenario, Scenario) and not hasattr(scenario, "draw"):
            raise TypeError(f"scenario must be a Scenario or a source of scenarios, got {shown(scenario)}")
        self._source = FixedScenario(scenario) if isinstance(scenario, Scenario) else scenario
        self.scenario = self._source.first
        self.scene = Scene()
        self._episode_info: Info = {}
        super().__init__(config, render_mode)

    @classmethod
    def default_config(cls) -> Config:
        """Return the default configuration."""
        return super().default_config() | {
            "observation": {"type": "EgoState"},
            "action": {"type": "ContinuousDemand"},
            "simulation_frequency": 60,
            "throttle": False,
            "forecast": {},
            "follow_up": 2.0,
            "reward": asdict(RewardParams()),
        }

    def configure(self, config: Config | None) -> None:
        """Apply a configuration; a refused one leaves the environment unchanged.

        Raises:
            ValueError: If a key is unknown or a value is out of range.
        """
        config = check_mapping("config", config)
        reward = check_mapping("reward", config.pop("reward", None))
        check_keys("key of config['reward']", reward, self.config["reward"])
        reward = {**self.config["reward"], **reward}
        if "follow_up" in config:
            config["follow_up"] = check_within("config['follow_up']", config["follow_up"], 0.0, 60.0, "s")
        weights = RewardParams(**reward)
        forecast = check_mapping("forecast", config.get("forecast"))
        check_keys("key of config['forecast']", forecast, asdict(ForecastParams()))
        ForecastParams(**forecast)  # raises an error for a value out of range
        super().configure(config)
        self.config["reward"], self.weights = reward, weights.record()
        before, self.simulation = vars(self).get("simulation"), self.make_simulation(1)
        self.controlled_vehicles = []  # the new simulation has no episode before the next reset
        if before is not None and before.rates.simulation == self.simulation.rates.simulation:
            self.simulation.take_sensors(before)

    def make_simulation(self, num_envs: int, threads: int = 1) -> Simulation:
        """Return a simulation of environments with this configuration; see `Simulation`."""
        config = self.config
        rates = Rates(simulation=config["simulation_frequency"], policy=config["policy_frequency"])
        forecast = ForecastParams(**config["forecast"]) if config["forecast"] else None
        return Simulation(
            num_envs, rates, self.weights, config["throttle"], config["follow_up"], threads, forecast
        )

    def attach_sensors(self, sensors: Sensors, camera_hz: float) -> None:
        """Draw and process the frames of cameras inside the steps, from the next reset on.

        Args:
            sensors: Cameras and neurons of one environment.
            camera_hz: Camera frames per second [Hz].
        """
        self.simulation.attach(sensors, camera_hz)
        self.simulation.show = self._shown

    def define_spaces(self) -> None:
        """Set the action and observation types and their spaces."""
        check_keys("observation type", [self.config["observation"].get("type")], ["EgoState"])
        self.observation_type = EgoState(self)
        self.action_type = make_action(self, self.config["action"])  # pyright: ignore[reportIncompatibleVariableOverride]
        self.observation_space = self.observation_type.space()
        self.action_space = self.action_type.space()

    @property
    def vehicle(self) -> EgoCar | None:  # type: ignore[override]
        """The car under test; None before the first reset."""
        return self.road.ego if self.controlled_vehicles else None

    @property
    def ego(self) -> EgoCar:
        """The car under test."""
        return cast(EgoCar, self.vehicle)

    def step(self, action: ArrayLike) -> tuple[np.ndarray, float, bool, bool, Info]:
        """Advance by one decision; see `AbstractEnv.step`."""
        if not self.controlled_vehicles:
            raise RuntimeError("the environment has no episode: call reset() before step()")
        self.time += 1 / self.config["policy_frequency"]
        self._simulate(action)
        if self.render_mode == "human":
            self.render()
        outcome = self.simulation.outcome
        ended = bool(outcome.terminated[0]), bool(outcome.truncated[0])
        return self.observation_type.observe(), float(outcome.rewards[0]), *ended, self._info(None)

    def _simulate(self, action: ArrayLike | None = None) -> None:
        """Advance by the simulation steps of one decision."""
        simulation = self.simulation
        if action is not None and not self.config["manual_control"]:
            # As `action_type.act`, without bringing the vehicles up to date.
            simulation.clock.demands[:] = self.action_type.decoder.read(np.reshape(action, -1), 1)
        on_step = self._automatic_rendering if self.viewer is not None and self.enable_auto_render else None
        simulation.step(simulation.clock.demands, _SELECTED, not self.rendering_paused, on_step)
        self.steps = int(simulation.state.episodes["steps"][0])
        self.road.refresh()  # for callers that keep references to vehicles
        self.enable_auto_render = False

    def restart_sensors(self) -> None:
        """Process a first frame of the present state with sensors attached after the reset."""
        self.simulation.equip(0, self.scene, self.road.network)
        self.simulation.show_frames(_SELECTED)

    def _reset(self) -> None:
        draw = self._source.draw(self.np_random)
        self.scenario, self._episode_info = draw.placement.scenario, draw.info
        self.scene, self.brake = draw.scene, self.episode_brake(draw.brake)
        self.rendering_paused = False
        simulation, network = self.simulation, draw.make_network()
        simulation.load(0, draw.placement, self.brake)
        self.road = BrakingRoad(network, self.np_random, simulation)
        self.controlled_vehicles = [self.road.ego]
        simulation.equip(0, self.scene, network)
        simulation.start(_SELECTED)

    def _shown(self, index: int) -> "BrakingEnv":
        return self

    def _info(self, obs: object, action: object = None) -> Info:
        values = self.simulation.outcome.infos[0].tolist()
        info = dict(zip(INFO_KEYS, values, strict=True)) | self._episode_info
        if self.simulation.forecasts is not None:
            info["ttb"] = float(self.simulation.forecasts["ttb"][0])
        return info
