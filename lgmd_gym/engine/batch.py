"""`BrakingBatch`: N braking environments with their cameras, episodes and outputs."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike

from lgmd_gym.aliases import Config, Info, Values
from lgmd_gym.engine.episodes import EpisodeQueue, Prepared
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.episode_source import EpisodeSource, FixedScenario
from lgmd_gym.envs.highway.road import BrakingRoad
from lgmd_gym.envs.info import INFO_KEYS
from lgmd_gym.neuron import LGMDParams, NeuronSpec
from lgmd_gym.sensing.assembly import Assembly, EgoMotion, EgoPose, TraceFrame, Traces
from lgmd_gym.sensing.channel import LGMD, ChannelSpec
from lgmd_gym.sensing.highway import camera_rate
from lgmd_gym.sensing.sensor_array import SensorArray


class BrakingBatch:
    """Episodes of N environments of one configuration, their observations and infos as arrays.

    `BrakingVectorEnv` is Gymnasium's face of it, and the benchmark plays its tasks in it.

    Args:
        sources: Source of the episodes of every environment.
        config: Configuration of `BrakingEnv`, for all environments.
        camera: See `LGMDObservation`; None for no camera, so that observations are those of `BrakingEnv`.
        neuron: See `LGMDObservation`.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        threads: Number of threads of a step, including the calling one.

    Attributes:
        num_envs: Number of environments N.
        single: One environment with this configuration.
        simulation: Physics, cameras and neurons.
        sensors: The cameras and neurons; None for no camera.
        fps: Camera frame rate [Hz].
        queue: Random generators and next episodes.
        traces: Frames of the present decisions; None if they are not recorded.
        episodes: Present episode of every environment; None before its first start.
        space: Observation space of one environment.

    Raises:
        ValueError: If a key or name is unknown, or a value is out of range.
    """

    def __init__(
        self,
        sources: Sequence[EpisodeSource],
        config: Config | None = None,
        camera: ChannelSpec | None = "fovea",
        neuron: str = LGMD,
        params: NeuronSpec = None,
        fps: float | None = None,
        include_frame: bool = False,
        include_base: bool = False,
        trace: bool = False,
        threads: int = 1,
    ) -> None:
        self.num_envs, self._config = len(sources), config or {}
        self.single = BrakingEnv(sources[0], config=config)
        self.simulation = self.single.make_simulation(self.num_envs, threads)
        self.queue = EpisodeQueue(sources, ahead=threads > 1, shown=camera is not None)
        self.episodes: list[Prepared | None] = [None] * self.num_envs
        self.sensors: SensorArray | None = None
        self.space: gym.Space[Any] = self.single.observation_space
        self._assembly: Assembly | None = None
        self.traces: Traces | None = None
        self._include_base = include_base
        self._constants: dict[str, np.ndarray] = {}
        self._viewers: dict[int, BrakingEnv] = {}
        self._shown: dict[int, Prepared] = {}  # the episodes of the viewers
        self.fps = 0.0
        if camera is not None:
            frequency, checked = self.simulation.rates.simulation, LGMDParams.make(params)
            self.fps = camera_rate(fps, frequency)
            self.sensors = sensors = SensorArray(camera, self.fps, checked, self.num_envs, neuron=neuron)
            if sensors.has_top_views and threads > 1:
                raise ValueError(f"threads must be 1 for top views, which highway-env draws, got {threads}")
            base = self.space if include_base else None
            self._assembly = Assembly(sensors, frequency, include_frame, base)
            self.space = self._assembly.space
            self.simulation.attach(sensors, self.fps)
            self.simulation.show = self.show
            if trace:
                self.record_traces()

    def record_traces(self) -> None:
        """Record the camera frames of the decisions from now on."""
        assert self.sensors is not None
        self.traces = Traces(self.sensors)
        self.simulation.on_frames = self._append_frames

    def start(self, selected: np.ndarray) -> None:
        """Start the next episodes of the selected environments, bool, shape (N,)."""
        for index in np.flatnonzero(selected).tolist():
            self.queue.seed(index, None)
            prepared = self.queue.next(index)
            draw, brake = prepared.draw, self.single.episode_brake(prepared.draw.brake)
            self.simulation.load(index, draw.placement, brake)
            self.simulation.equip(index, draw.scene, prepared.network, prepared.geometry)
            self.episodes[index] = prepared
            self._set_constants(index, draw.info)
            if self.traces is not None:
                self.traces.take(index)
        self.simulation.start(selected)

    def read_demands(self, actions: ArrayLike) -> np.ndarray:
        """Return the longitudinal demands of actions, in [-1, 1], float64, shape (N,).

        Raises:
            ValueError: If an action is out of range.
        """
        return self.single.action_type.decoder.read(actions, self.num_envs)

    def empty(self) -> Any:
        """Return arrays for `observations`."""
        if self._assembly is None:
            return np.zeros((self.num_envs, 3), np.float32)
        out = self._assembly.empty()
        return out | {"base": np.zeros((self.num_envs, 3), np.float32)} if self._include_base else out

    def observations(self, out: Any = None) -> Any:
        """Return the present observations of all environments, arrays of shape (N, …).

        Args:
            out: Arrays of `empty` to write; new ones if None.
        """
        simulation, out = self.simulation, self.empty() if out is None else out
        if self._assembly is None:
            return simulation.ego_states(out)
        elapsed_s, clock = simulation.rates.steps / simulation.rates.simulation, simulation.clock
        before, after = EgoPose(clock.headings, clock.speeds), EgoPose(simulation.headings, simulation.speeds)
        self._assembly.observations(EgoMotion.between(before, after, elapsed_s), out)
        if self._include_base:
            simulation.ego_states(out["base"])
        return out

    def infos(self) -> dict[str, np.ndarray]:
        """Return the present infos without traces, arrays of shape (N,); the next step may overwrite them."""
        infos = self.simulation.outcome.infos
        arrays: dict[str, np.ndarray] = {key: infos[key] for key in INFO_KEYS} | self._constants
        if self.simulation.forecasts is not None:
            arrays["ttb"] = self.simulation.forecasts["ttb"]
        return arrays if self._assembly is None else arrays | self._assembly.infos()

    def take_trace(self) -> list[TraceFrame]:
        """Return the camera frames since the last decision as arrays of shape (N,) and (N, cameras).

        The `time` of a frame is NaN in environments that have fewer frames.
        """
        if self.traces is not None:
            return self.traces.take_arrays()
        simulation, sensors = self.simulation, self.sensors
        assert sensors is not None
        assert simulation.rates.steps == simulation.stride  # the present outputs are the only frame
        times: Any = simulation.times
        speeds: Any = simulation.speeds
        return [TraceFrame(times, speeds, sensors.responses)]

    def info_of(self, row: Values, index: int) -> Values:
        """Return the info of environment `index` as a single environment has it, from its row of `infos`.

        A row has the constants of other episodes, too, where sources differ.
        """
        prepared = self.episodes[index]
        assert prepared is not None
        shared = {key: value for key, value in row.items() if key not in self._constants}
        return shared | prepared.draw.info

    def show(self, index: int) -> BrakingEnv:
        """Return a highway-env environment in the present state of environment `index`, for its renderer."""
        prepared = self.episodes[index]
        assert prepared is not None
        if index not in self._viewers:
            source = FixedScenario(prepared.draw.placement.scenario)
            self._viewers[index] = BrakingEnv(source, config=self._config, render_mode="rgb_array")
        viewer = self._viewers[index]
        if self._shown.get(index) is not prepared:
            viewer.road = BrakingRoad(prepared.network, prepared.generator, self.simulation, index)
            viewer.controlled_vehicles = [viewer.road.ego]
            self._shown[index] = prepared
        return viewer

    def close(self) -> None:
        """Stop background threads, and close the cameras and viewers."""
        self.queue.close()
        for viewer in self._viewers.values():
            viewer.close()
        self._viewers.clear()
        if self.sensors is not None:
            self.sensors.close()

    def _set_constants(self, index: int, info: Info) -> None:
        """Set the keys of the info that are constant in an episode."""
        for key, value in info.items():
            if key not in self._constants:
                kind = type(value) if isinstance(value, int | float | bool) else object
                self._constants[key] = np.zeros(self.num_envs, kind)
            self._constants[key][index] = value

    def _append_frames(self, first: int, last: int, due: np.ndarray) -> None:
        """Append the present camera frame of the environments in a range to their traces."""
        assert self.traces is not None
        for index in (first + np.flatnonzero(due[first:last])).tolist():
            simulation = self.simulation
            self.traces.append(index, simulation.times.item(index), simulation.speeds.item(index))
