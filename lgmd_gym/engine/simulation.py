"""Simulation: the physics, cameras and neurons of many environments, stepped in compiled code."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.engine.kernels import advance, show_episodes
from lgmd_gym.envs.decisions import (
    finish_decisions,
    make_clock,
    make_outcome,
    make_physics,
    start_decisions,
    start_episodes,
)
from lgmd_gym.envs.dynamics.brake import BRAKE, BrakeParams
from lgmd_gym.envs.episode_source import Draw
from lgmd_gym.envs.physics_state import PhysicsState
from lgmd_gym.envs.reward import REWARD
from lgmd_gym.envs.scene import SceneArrays
from lgmd_gym.kernels.threads import Threads
from lgmd_gym.sensing.sensor_array import SensorArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Rates:
    """Frequencies that all environments of a simulation share.

    Attributes:
        simulation: Simulation steps per second [Hz].
        policy: Decisions per second, a divisor of `simulation` [Hz].
        camera: Camera frames per second, a divisor of `simulation` [Hz].
    """

    simulation: float
    policy: float
    camera: float

    @property
    def steps(self) -> int:
        """Simulation steps per decision."""
        return int(self.simulation // self.policy)

    @property
    def stride(self) -> int:
        """Simulation steps per camera frame."""
        return round(self.simulation / self.camera)


class Snapshot(NamedTuple):
    """State of an episode between two decisions, without its cameras and neurons.

    Attributes:
        state: See `PhysicsState.save`.
        brake: `BRAKE` record.
    """

    state: dict[str, np.ndarray]
    brake: np.ndarray


class Simulation:
    """Episodes of N environments with their cameras and neurons.

    Args:
        num_envs: Number of environments N.
        rates: Frequencies.
        sensors: Cameras and neurons of the environments; None for physics only.
        throttle: Whether demands above 0 have an effect.
        threads: Number of threads that share the environments of a step, including the calling one.

    Attributes:
        state: State of the episodes.
        brakes: `BRAKE` records of the present episodes, shape (N,).
        weights: `REWARD` records, shape (N,); set them before the first `load`.
        outcome: Results of the last step or start of each environment.
        clock: Progress of the decisions.
        physics: The fields of `Physics`.
        on_frames: Called after each camera frame with a range of environments and the selection of those that
            have a new frame; None for no call. May be called from several threads at once.
    """

    def __init__(
        self,
        num_envs: int,
        rates: Rates,
        sensors: SensorArray | None,
        throttle: bool,
        threads: int = 1,
    ) -> None:
        self.num_envs, self.rates, self.sensors = num_envs, rates, sensors
        self.state = PhysicsState(num_envs)
        self._throttle = throttle
        self.brakes, self.weights = np.zeros(num_envs, BRAKE), np.zeros(num_envs, REWARD)
        self.clock, self.outcome = make_clock(num_envs), make_outcome(num_envs)
        self.on_frames: Callable[[int, int, np.ndarray], None] | None = None
        # Plain tuples are cheaper to pass to compiled functions.
        self._scenes: Any = tuple(self._make_scenes())
        self._clock: Any = tuple(self.clock)
        self._results: Any = tuple(self.outcome)
        self._link()
        self._threads = Threads(threads)

    def load(self, index: int, draw: Draw, network: Any, brake: BrakeParams) -> None:
        """Load an episode into environment `index`; `start` begins it.

        Args:
            index: Index of the environment.
            draw: The episode.
            network: Its highway-env road network; not used without sensors.
            brake: Its brake, see `EgoBrakeEnv.episode_brake`.
        """
        if self.state.load(index, draw.placement, brake.max_demands(self.rates.policy)):
            self._link()
        self.brakes[index] = brake.record(self._throttle)
        if self.sensors is not None:
            self.sensors.set_scene(index, draw.scene, brake.max_deceleration)
            self.sensors.set_road(index, network)

    def start(self, selected: np.ndarray) -> None:
        """Start the loaded episodes of the selected environments, bool, shape (N,)."""
        if self.sensors is not None:
            self.sensors.reset(selected)
        self._run(self._start_part, selected)

    def step(self, demands: np.ndarray, active: np.ndarray, rendering: bool = True) -> None:
        """Advance the active environments by one decision.

        Args:
            demands: Longitudinal demands in [-1, 1], float64, shape (N,).
            active: Selection of the environments, bool, shape (N,).
            rendering: Whether the cameras and neurons process their frames.
        """
        self.clock.demands[:] = demands
        self.clock.remaining[:] = np.where(active, 0, -1)
        self._run(self._step_part, rendering)

    def save(self, index: int) -> Snapshot:
        """Return the state of environment `index`."""
        return Snapshot(self.state.save(index), self.brakes[index].copy())

    def restore(self, index: int, snapshot: Snapshot) -> None:
        """Set the state of environment `index`.

        Args:
            index: Index of the environment.
            snapshot: State from `save` of this simulation, or of another one with the same rates and weights.
        """
        if self.state.restore(index, snapshot.state):
            self._link()
        self.brakes[index] = snapshot.brake

    def _run(self, part: Callable[..., None], *arguments: Any) -> None:
        if self._threads.count == 1:
            part(0, self.num_envs, *arguments)
        else:
            self._threads.run(part, self.num_envs, arguments)

    def _start_part(self, first: int, last: int, selected: np.ndarray) -> None:
        start_episodes(first, last, selected, self.physics, self._clock, self._results)
        show_episodes(first, last, self.rates.simulation, selected, self.physics, self._scenes)
        self._process(first, last, selected)

    def _step_part(self, first: int, last: int, rendering: bool) -> None:
        rates, physics, clock = self.rates, self.physics, self._clock
        start_decisions(first, last, rates.steps, physics, clock)
        while advance(first, last, rates.stride, rates.simulation, physics, clock, self._scenes):
            if rendering:
                self._process(first, last, self.clock.due)
        finish_decisions(first, last, rates.policy, physics, clock, self._results)

    def _process(self, first: int, last: int, due: np.ndarray) -> None:
        if self.sensors is not None:
            self.sensors.process(first, last, due)
            if self.on_frames is not None:
                self.on_frames(first, last, due)

    def _link(self) -> None:
        """Collect the arrays of the physics."""
        self.physics: Any = tuple(make_physics(self.state, self.brakes, self.weights))

    def _make_scenes(self) -> SceneArrays:
        if self.sensors is None:
            from lgmd_gym.camera.env_state import SCENE
            from lgmd_gym.camera.objects import OBJECT

            shape = self.num_envs
            return SceneArrays(
                np.zeros(shape, SCENE), np.zeros((shape, 512), OBJECT), np.zeros(shape, np.int64)
            )
        return SceneArrays(self.sensors.scenes, self.sensors.objects, self.sensors.object_counts)
