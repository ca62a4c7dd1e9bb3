"""`Simulation`: the episodes of N environments with their cameras, stepped in compiled code."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from lgmd_gym.camera.env_state import SCENE
from lgmd_gym.camera.objects import MAX_DRAWN, OBJECT
from lgmd_gym.camera.scene import Scene
from lgmd_gym.envs.decisions import (
    advance,
    finish_decisions,
    make_clock,
    make_outcome,
    make_physics,
    show_episodes,
    start_decisions,
    start_episodes,
)
from lgmd_gym.envs.dynamics.brake import BRAKE, BrakeParams
from lgmd_gym.envs.dynamics.episode import Arrays, Physics
from lgmd_gym.envs.forecast import FORECAST, UNKNOWN, ForecastParams, write_forecasts
from lgmd_gym.envs.physics_state import PhysicsState, Placement
from lgmd_gym.envs.reward import REWARD
from lgmd_gym.envs.scene import SceneArrays
from lgmd_gym.kernels.threads import Threads, check_compiling

if TYPE_CHECKING:
    import gymnasium as gym
    from highway_env.road.road import RoadNetwork

    from lgmd_gym.camera.road_geometry import RoadGeometry


class Sensors(Protocol):
    """Cameras of the environments, and what processes their frames; see `SensorArray`."""

    scenes: np.ndarray
    objects: np.ndarray
    object_counts: np.ndarray

    @property
    def has_top_views(self) -> bool:
        """Whether highway-env draws one of the cameras."""
        ...

    def set_scene(self, index: int, scene: Scene, max_deceleration: float) -> None:
        """Set the scene and the full braking [m/s²] of the episode of an environment."""
        ...

    def set_road(self, index: int, road: "RoadNetwork", geometry: "RoadGeometry | None" = None) -> None:
        """Set the road of an environment, and its geometry if that is known."""
        ...

    def read_top_views(self, env: "gym.Env", index: int) -> None:
        """Render the cameras of an environment that highway-env draws."""
        ...

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Reset the processing of the selected environments."""
        ...

    def process(self, first: int, last: int, active: np.ndarray | None = None) -> None:
        """Draw and process a frame of the selected environments in a range."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Rates:
    """Frequencies that all environments of a simulation share."""

    simulation: float  # simulation steps per second [Hz]
    policy: float  # decisions per second, a divisor of `simulation` [Hz]

    @property
    def steps(self) -> int:
        """Simulation steps per decision."""
        return int(self.simulation // self.policy)


class Simulation:
    """Episodes of N environments with their cameras and neurons.

    Args:
        num_envs: Number of environments N.
        rates: Frequencies.
        weights: `REWARD` record of all environments.
        throttle: Whether demands above 0 have an effect.
        follow_up: Time for which a resolved conflict must last to end an episode, see `BrakingEnv` [s].
        threads: Number of threads that share the environments of a step, including the calling one.
        forecast: How times to brake are forecast; None for no forecast.

    Attributes:
        state: State of the episodes.
        brakes: `BRAKE` records of the present episodes, shape (N,).
        weights: `REWARD` records, shape (N,).
        outcome: Results of the last step or start of each environment.
        clock: Progress of the decisions.
        forecasts: `FORECAST` records, shape (N,); None without a forecast.
        physics: The fields of `Physics`.
        sensors: Cameras and neurons of the environments; None for physics only.
        stride: Simulation steps per camera frame.
        on_frames: Called after each camera frame with a range of environments and the selection of those that
            have a new frame; None for no call. May be called from several threads at once.
        show: Returns a highway-env environment in the present state of one of the environments, for cameras
            that highway-env draws; required for these.
    """

    sensors: Sensors | None = None
    stride = 2**31  # no step of an episode is the last one before a frame
    on_frames: Callable[[int, int, np.ndarray], None] | None = None
    show: "Callable[[int], gym.Env] | None" = None

    def __init__(
        self,
        num_envs: int,
        rates: Rates,
        weights: np.ndarray,
        throttle: bool,
        follow_up: float,
        threads: int = 1,
        forecast: ForecastParams | None = None,
    ) -> None:
        check_compiling()
        self.num_envs, self.rates = num_envs, rates
        self.state = PhysicsState(num_envs)
        self._throttle, self._follow_up = throttle, follow_up
        self.brakes, self.weights = np.zeros(num_envs, BRAKE), np.zeros(num_envs, REWARD)
        self.weights[:] = weights
        self.clock, self.outcome = make_clock(num_envs), make_outcome(num_envs)
        self._threads = Threads(threads)
        self._forecast = forecast
        self.forecasts = None if forecast is None else np.zeros(num_envs, FORECAST)
        self._link()
        self._link_scenes()

    def attach(self, sensors: Sensors, camera_hz: float) -> None:
        """Draw and process the frames of cameras in the steps from now on.

        Episodes that are already loaded need `equip` and `show_frames`.

        Args:
            sensors: Cameras and neurons of the environments.
            camera_hz: Camera frames per second, a divisor of the simulation frequency [Hz].
        """
        self.sensors, self.stride = sensors, round(self.rates.simulation / camera_hz)
        self._link_scenes()

    def take_sensors(self, other: "Simulation") -> None:
        """Continue with the cameras and callbacks of a simulation with the same simulation frequency."""
        self.sensors, self.stride = other.sensors, other.stride
        self.on_frames, self.show = other.on_frames, other.show
        self._link_scenes()

    def load(self, index: int, placement: Placement, brake: BrakeParams) -> None:
        """Load the physics of an episode into environment `index`; `start` begins it.

        Args:
            index: Index of the environment.
            placement: The scenario.
            brake: Its brake, see `EgoBrakeEnv.episode_brake`.
        """
        if self.state.load(index, placement, brake.max_demands(self.rates.policy)):
            self._link()
        self.brakes[index] = brake.record(self._throttle)

    def equip(
        self, index: int, scene: Scene, network: "RoadNetwork", geometry: "RoadGeometry | None" = None
    ) -> None:
        """Prepare the cameras, if any, for the episode of environment `index`.

        Args:
            index: Index of the environment.
            scene: Scene of the episode.
            network: highway-env road network of the episode.
            geometry: Its geometry in the scene, if it is known.
        """
        if self.sensors is not None:
            self.sensors.set_scene(index, scene, float(self.brakes["max_deceleration"][index]))
            self.sensors.set_road(index, network, geometry)

    def start(self, selected: np.ndarray) -> None:
        """Start the loaded episodes of the selected environments, bool, shape (N,), with a first frame."""
        start_episodes(0, self.num_envs, selected, self.physics, self._clock, self._results)
        if self.forecasts is not None:
            self.forecasts["begun"][selected] = UNKNOWN
            self._run(self._forecast_part, selected)
        self.show_frames(selected)

    def show_frames(self, selected: np.ndarray) -> None:
        """Reset the neurons of the selected environments, and process frames of their present states."""
        if self.sensors is not None:
            self.sensors.reset(selected)
            self._run(self._show_part, selected)

    def step(
        self,
        demands: np.ndarray,
        active: np.ndarray,
        rendering: bool = True,
        on_step: Callable[[], None] | None = None,
    ) -> None:
        """Advance the active environments by one decision.

        Args:
            demands: Longitudinal demands in [-1, 1], float64, shape (N,).
            active: Selection of the environments, bool, shape (N,).
            rendering: Whether the cameras and neurons process their frames.
            on_step: Called between two simulation steps; only with one thread.
        """
        self.clock.demands[:] = demands
        self.clock.remaining[:] = np.where(active, 0, -1)
        self._run(self._step_part, rendering, on_step)
        if self.forecasts is not None:
            self._run(self._forecast_part, active)

    def ego_states(self, out: np.ndarray | None = None) -> np.ndarray:
        """Ego speeds [m/s], accelerations [m/s²] and yaw rates [rad/s, + right], float32, shape (N, 3).

        Args:
            out: Array to write; a new one if None.
        """
        out = np.empty((self.num_envs, 3), np.float32) if out is None else out
        egos = self.state.bodies[:, 0]
        out[:, 0], out[:, 1], out[:, 2] = egos["speed"], egos["acceleration"], self.state.egos["yaw_rate"]
        return out

    @property
    def speeds(self) -> np.ndarray:
        """Ego speeds, float64, shape (N,) [m/s]."""
        return self.state.bodies["speed"][:, 0]

    @property
    def headings(self) -> np.ndarray:
        """Ego headings, float64, shape (N,) [rad, + right]; see `clock` for those before the decision."""
        return self.state.bodies["heading"][:, 0]

    @property
    def times(self) -> np.ndarray:
        """Simulated times since the reset, float64, shape (N,) [s]."""
        return self.state.episodes["steps"] / self.rates.simulation

    def _run(self, part: Callable[..., None], *arguments: object) -> None:
        if self._threads.count == 1:
            part(0, self.num_envs, *arguments)
        else:
            self._threads.run(part, self.num_envs, arguments)

    def _show_part(self, first: int, last: int, selected: np.ndarray) -> None:
        show_episodes(first, last, self.rates.simulation, selected, self.physics, self._scenes)
        self._process(first, last, selected)

    def _step_part(self, first: int, last: int, rendering: bool, on_step: Callable[[], None] | None) -> None:
        rates, physics, clock, scenes = self.rates, self.physics, self._clock, self._scenes
        start_decisions(first, last, rates.steps, physics, clock)
        for left in (0,) if on_step is None else range(rates.steps - 1, -1, -1):
            while advance(first, last, left, self.stride, rates.simulation, physics, clock, scenes):
                if rendering:
                    self._process(first, last, self.clock.due)
            if on_step is not None and left:
                on_step()
        finish_decisions(first, last, rates.policy, self._follow_up, physics, clock, self._results)

    def _forecast_part(self, first: int, last: int, selected: np.ndarray) -> None:
        forecast, rates = self._forecast, self.rates
        assert forecast is not None
        write_forecasts(
            first,
            last,
            selected,
            rates.steps,
            float(rates.simulation),
            forecast.share,
            forecast.foresight,
            self.physics,
            self._fork,
            self.forecasts,
        )

    def _process(self, first: int, last: int, due: np.ndarray) -> None:
        if self.sensors is None:
            return
        if self.sensors.has_top_views and self.show is not None:
            for index in (first + np.flatnonzero(due[first:last])).tolist():
                self.sensors.read_top_views(self.show(index), index)
        self.sensors.process(first, last, due)
        if self.on_frames is not None:
            self.on_frames(first, last, due)

    def _link(self) -> None:
        """Collect the arrays; plain tuples are cheaper to pass to compiled functions."""
        physics = make_physics(self.state, self.brakes, self.weights)
        self.physics: Arrays = tuple(physics)
        if self._forecast is not None:
            self._fork: Arrays = tuple(_fork_of(physics))
        self._clock: Arrays = tuple(self.clock)
        self._results: Arrays = tuple(self.outcome)

    def _link_scenes(self) -> None:
        sensors, num_envs = self.sensors, self.num_envs
        scenes = (
            SceneArrays(
                np.zeros(num_envs, SCENE),
                np.zeros((num_envs, MAX_DRAWN), OBJECT),
                np.zeros(num_envs, np.int64),
            )
            if sensors is None
            else SceneArrays(sensors.scenes, sensors.objects, sensors.object_counts)
        )
        self._scenes: Arrays = tuple(scenes)


def _fork_of(physics: Physics) -> Physics:
    """Return the arrays of forks: copies of what a step changes, and the same arrays otherwise."""
    changed = ("bodies", "episodes", "egos", "lines", "pending")
    return physics._replace(**{name: getattr(physics, name).copy() for name in changed})
