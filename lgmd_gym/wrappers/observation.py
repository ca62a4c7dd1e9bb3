"""LGMDObservation: wrapper that adds cameras and LGMD neurons to a highway-env environment."""

import json
import warnings
from typing import Any, SupportsFloat, cast

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike

from lgmd_gym.aliases import Arguments, Info, Observation, Values
from lgmd_gym.camera import Scene
from lgmd_gym.errors import check_flags, check_mapping
from lgmd_gym.neuron import LGMDParams, NeuronSpec, Response
from lgmd_gym.sensing.assembly import Assembly, EgoMotion, EgoPose, Traces, row_of
from lgmd_gym.sensing.channel import LGMD, ChannelSpec, make_channels, plain_values
from lgmd_gym.sensing.highway import SensorHost, camera_rate, check_highway_env, on_road_step
from lgmd_gym.sensing.sensor_array import SensorArray


class LGMDObservation(gym.Wrapper, RecordConstructorArgs):
    """Observe LGMD neurons, each driven by a camera on the ego vehicle of a highway-env environment.

    Every camera frame is rendered and processed, even if the policy acts at a lower rate. In a decision
    without a new frame, the observation keeps the last values. `reset` processes the first frame.

    **Observation space**: a `Dict` of `Box` spaces, float32 unless stated otherwise.

    ======================  ==========================  =================================================
    key                     shape                       meaning, range, unit
    ======================  ==========================  =================================================
    ``spike_frequency``     (channels,)                 spikes of the last n_ts frames [spikes/s], from 0
                                                        to about 10 · fps
    ``membrane_potential``  (channels,)                 K (eq. 10), 0.5 to 1; from 0 with
                                                        ``neuron="dsn"``
    ``ffi``                 (channels,)                 F̂ [grey levels], 0 to 255 / (1 − Σ a_i)
    ``ego_speed``           (1,)                        ego speed [m/s], −100 to 100
    ``ego_yaw_rate``        (1,)                        mean yaw rate of the decision [rad/s], positive
                                                        to the right as in highway-env
    ``ego_acceleration``    (1,)                        mean acceleration of the decision [m/s²]
    ``known_deceleration``  (1,)                        the car's estimate of its full braking [m/s²], of
                                                        cameras with ``brake_known`` only
    ``column_potential``    (columns,)                  K of each column of each channel in turn, 0 to 1, of
                                                        channels with ``columns`` only
    ``frame``               (height, width, channels)   grey frames, uint8, with `include_frame`
    ``base``                as in the environment       its own observation, with `include_base`
    ======================  ==========================  =================================================

    **Info**: the keys of the environment and these.

    =====================================  ==============================================================
    key                                    meaning
    =====================================  ==============================================================
    ``lgmd/<channel>/spike_frequency``     as in the observation, for one channel [spikes/s]
    ``lgmd/<channel>/membrane_potential``  as in the observation, for one channel
    ``lgmd/<channel>/ffi``                 as in the observation, for one channel [grey levels]
    ``lgmd/alert``                         whether the spike frequency of any channel is >= t_sf
    ``lgmd/trace``                         a `TraceFrame` per camera frame of the step, with `trace`
    =====================================  ==============================================================

    An environment can set the scene of each episode through an attribute ``scene``, a `Scene`, together with
    ``brake``, whose ``max_deceleration`` [m/s²] is the full braking of its car.

    Args:
        env: A highway-env environment, wrapped or not.
        camera: A preset name ("wide", "standard", "tele", "fovea", "paper"), "birdseye", a `Camera`, a
            `Channel`, a mapping of the fields of either, or a sequence of these.
        neuron: Neuron of the cameras without their own, see `lgmd_gym.neuron.register`.
        params: `LGMDParams` or a mapping of its fields; None for the defaults.
        fps: Camera frame rate [Hz]; None for 30 if that divides `simulation_frequency`, else
            `simulation_frequency` itself.
        include_frame: Whether to include the frames; all cameras must have the same shape.
        include_base: Whether to include the observation of the wrapped environment.
        trace: Whether to add ``lgmd/trace`` to the info.
        scene: Scene of an environment without its own, a `Scene` or a mapping of its fields; None for the
            laboratory.

    Attributes:
        channels: The channels.
        rendering_paused: If set, skip rendering until the next reset; the outputs of the neurons are
            constant meanwhile.

    Raises:
        ValueError: If `env` is not a highway-env environment, a camera or parameter is unknown, `fps` does
            not divide `simulation_frequency`, or `include_frame` is set for cameras of different shapes.

    Example:
        >>> import gymnasium as gym, lgmd_gym
        >>> env = gym.make("LGMD/CCRs-v0", ego_speed=8.0)
        >>> observation, info = env.reset(seed=1)
        >>> float(observation["membrane_potential"][0])
        0.5
    """

    def __init__(
        self,
        env: gym.Env,
        camera: ChannelSpec = "fovea",
        neuron: str = LGMD,
        params: NeuronSpec = None,
        fps: float | None = None,
        include_frame: bool = False,
        include_base: bool = False,
        trace: bool = False,
        scene: Scene | Values | None = None,
    ) -> None:
        check_highway_env(env)
        gym.Wrapper.__init__(self, env)
        check_flags(include_frame=include_frame, include_base=include_base, trace=trace)
        self.params = LGMDParams.make(params)
        self.channels, self._scene = make_channels(camera, neuron), Scene.make(scene)
        self.include_frame, self.include_base, self._trace = include_frame, include_base, trace
        self._requested_fps = fps
        self._was_reset = False
        self._substeps, self._last = 0, (0, EgoPose(0.0, 0.0))  # steps and pose at the last observation
        self._hosted = isinstance(env.unwrapped, SensorHost)
        if self._hosted:
            _check_no_cameras(env)
        self.rendering_paused = False
        self._build_sensors()
        # After the checks of the arguments, because JSON has no other values.
        RecordConstructorArgs.__init__(
            self,
            camera=_to_json(camera),
            neuron=neuron,
            params=_to_json(params),
            fps=fps,
            include_frame=include_frame,
            include_base=include_base,
            trace=trace,
            scene=_to_json(scene),
        )

    def reset(self, *, seed: int | None = None, options: Arguments | None = None) -> tuple[Observation, Info]:
        """Reset the environment and the neurons, and process the first frame.

        Raises:
            ValueError: If ``options["config"]`` has a simulation frequency that the camera rate does not
                divide; the environment stays as it was.
        """
        self._check_frequency(options)
        base_env = self._highway_env
        if self._traces is not None:
            self._traces.take(0)
        if self._hosted:
            self._attach()
        base, info = self.env.reset(seed=seed, options=options)
        changed = base_env.config["simulation_frequency"] != self._simulation_frequency
        if changed:
            self._build_sensors()
        self._substeps, self._last = 0, (0, EgoPose(0.0, 0.0))
        self.rendering_paused, self._was_reset = False, True
        if not self._hosted:
            self.sensors.reset()
            self._set_scene()
            on_road_step(self.env, self._on_substep)
            self._process_frame()
        elif changed:
            self._attach()
            base_env.restart_sensors()
        return self._observation(base, self._take_motion()), self._extend_info(info)

    def step(self, action: ArrayLike) -> tuple[Observation, SupportsFloat, bool, bool, Info]:
        """Step the environment and process its camera frames."""
        if not self._was_reset:
            raise RuntimeError("reset must be called before step")
        base, reward, terminated, truncated, info = self.env.step(action)
        observation = self._observation(base, self._take_motion())
        return observation, reward, terminated, truncated, self._extend_info(info)

    @property
    def rendering_paused(self) -> bool:
        """Whether no frames are rendered until the next reset."""
        return self._paused

    @rendering_paused.setter
    def rendering_paused(self, value: bool) -> None:
        self._paused = value
        if self._hosted:
            self._highway_env.rendering_paused = value

    @property
    def trace(self) -> bool:
        """Whether the info has ``lgmd/trace``; a change applies from the next reset on."""
        return self._trace

    @trace.setter
    def trace(self, value: bool) -> None:
        self._trace = value
        self._traces = Traces(self.sensors) if value else None

    def close(self) -> None:
        """Close the cameras, then the environment."""
        self.sensors.close()
        super().close()

    @property
    def frames(self) -> dict[str, np.ndarray]:
        """The last frame of each camera, uint8 (height, width); the next frame overwrites it."""
        return {name: self.sensors.frame_of(index) for index, name in enumerate(self.sensors.names)}

    @property
    def response(self) -> Response:
        """Outputs of the neurons for the last camera frame, arrays of shape (channels,)."""
        return self.sensors.response_of()

    @property
    def _highway_env(self) -> Any:
        return self.env.unwrapped

    def _build_sensors(self) -> None:
        """Build the sensors and the observation space for the current simulation frequency."""
        frequency = self._highway_env.config["simulation_frequency"]
        self.fps = camera_rate(self._requested_fps, frequency)
        self._simulation_frequency = frequency
        self._stride = round(self._simulation_frequency / self.fps)
        self.sensors = SensorArray(self.channels, self.fps, self.params)
        base = self.env.observation_space if self.include_base else None
        self._assembly = Assembly(self.sensors, frequency, self.include_frame, base)
        self.trace = self._trace
        self.observation_space = self._assembly.space

    def _attach(self) -> None:
        """Let the environment draw the frames inside its steps."""
        base = self._highway_env
        base.attach_sensors(self.sensors, self.fps)
        base.simulation.on_frames = None if self._traces is None else self._on_frames

    def _set_scene(self) -> None:
        """Set the scene of the episode."""
        base = self._highway_env
        if hasattr(base, "scene"):
            self.sensors.set_scene(0, base.scene, base.brake.max_deceleration)
        else:
            self.sensors.set_scene(0, self._scene)

    def _check_frequency(self, options: Arguments | None) -> None:
        """Refuse a simulation frequency in the options of a reset before the environment applies it."""
        config = check_mapping("config", check_mapping("options", options).get("config"))
        if "simulation_frequency" in config:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # _build_sensors warns
                camera_rate(self._requested_fps, config["simulation_frequency"])

    def _on_substep(self) -> None:
        self._substeps += 1
        if self._substeps % self._stride == 0:
            self._process_frame()

    def _process_frame(self) -> None:
        if self.rendering_paused:
            return
        self.sensors.read(self._highway_env)
        self.sensors.process(0, 1)
        if self._traces is not None:
            time = self._substeps / self._simulation_frequency
            self._traces.append(0, time, float(self._highway_env.vehicle.speed))

    def _on_frames(self, *_: object) -> None:
        if self._traces is None:  # switched off during the episode
            return
        simulation = self._highway_env.simulation
        self._traces.append(0, float(simulation.times[0]), float(simulation.speeds[0]))

    def _take_motion(self) -> EgoMotion:
        """Return the motion of the ego since the last call or reset."""
        base = self._highway_env
        if self._hosted:
            simulation = base.simulation
            steps = simulation.state.episodes["steps"].item(0)
            pose = EgoPose(simulation.headings.item(0), simulation.speeds.item(0))
        else:
            steps, pose = self._substeps, EgoPose(float(base.vehicle.heading), float(base.vehicle.speed))
        (last_steps, last_pose), self._last = self._last, (steps, pose)
        return EgoMotion.between(last_pose, pose, (steps - last_steps) / self._simulation_frequency)

    def _observation(self, base: np.ndarray, motion: EgoMotion) -> Observation:
        observation = row_of(self._assembly.observations(motion), 0)
        if self.include_base:
            observation["base"] = base
        return observation

    def _extend_info(self, info: Info) -> Info:
        info = info | row_of(self._assembly.infos(), 0)
        if self._traces is not None:
            info["lgmd/trace"] = self._traces.take(0)
        return info


def _check_no_cameras(env: gym.Env) -> None:
    """Raise ValueError if an environment that draws its own frames has cameras already."""
    while isinstance(env, gym.Wrapper):
        if isinstance(env, LGMDObservation):
            raise ValueError(
                "env must have no cameras, got LGMDObservation; use camera=None, or one list of cameras"
            )
        env = env.env


def _to_json(value: object) -> object:
    """Return an argument as plain JSON values, for `EnvSpec.to_json`."""
    return json.loads(json.dumps(plain_values(value), default=_number_to_json))


def _number_to_json(value: object) -> object:
    """Return a number or path that JSON does not know."""
    return cast(Any, value).item() if isinstance(value, np.generic) else str(value)
