"""`LGMDObservation`: a locust looming neuron behind a camera on any highway-env car."""

import json
from dataclasses import asdict
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from gymnasium.utils import RecordConstructorArgs

from lgmd_gym.camera import CameraParams
from lgmd_gym.neuron import LGMDParams, Response
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.road_hook import check_highway, on_road_step
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import make_space, signal_info, signals, yaw_rate


class TraceFrame(NamedTuple):
    """What the eye told at one camera frame.

    Attributes:
        time: Simulated time since the reset [s].
        ego_speed: [m/s].
        response: The neurons' answer, each field an array of shape (cameras,).
    """

    time: float
    ego_speed: float
    response: Response


class LGMDObservation(gym.Wrapper, RecordConstructorArgs):
    """Observe the spike frequency of an LGMD that watches the road through a camera on the ego.

    Every camera frame inside a decision is rendered and stepped, however slowly the policy acts; a decision
    without a new frame holds the last values. At `reset` the neuron sees its first frame.

    The observation is a `Dict`, float32 unless said otherwise:

    ==================  ===========================  ======================================================
    key                 shape                        meaning, range
    ==================  ===========================  ======================================================
    spike_frequency     (cameras,)                   spikes/s over the last N_ts frames, [0, 10·fps]-ish
    membrane_potential  (cameras,)                   K of eq. 10, [0.5, 1]
    ffi                 (cameras,)                   F̂ of FFI-M in grey levels, [0, 255/(1 − Σa_i)]
    ego_speed           (1,)                         [m/s]
    ego_yaw_rate        (1,)                         mean over the decision [rad/s], + right as highway-env
    frame               (height, width, cameras)     uint8, if `include_frame`
    base                as the environment's         if `include_base`
    ==================  ===========================  ======================================================

    `info` gains, as floats, `lgmd/<camera>/spike_frequency`, `lgmd/<camera>/membrane_potential`,
    `lgmd/<camera>/ffi`, and the bool `lgmd/alert`: whether any camera's frequency is at its alert level.

    An environment may change the view at each reset through an attribute `camera_fields`: a dict of
    `CameraParams` fields and `condition`, laid over the cameras.

    Args:
        env: Any highway-env environment, wrapped or not.
        camera: A preset name ("wide", "standard", "tele", "fovea", "paper"), "birdseye", a `CameraParams`,
            the dict of one, or a list of these.
        params: `LGMDParams` or the dict of one; None for the paper's values.
        fps: Camera frames per second; None for 30 where that divides `simulation_frequency`, else every
            simulation step.
        include_frame: Whether the frames are part of the observation; the cameras need one shape.
        include_base: Whether the wrapped environment's own observation is.
        trace: Whether `info["lgmd/trace"]` lists a `TraceFrame` for every camera frame of the step.

    Attributes:
        rendering_paused: Set it to have no more frames drawn until the next reset, because nobody will look: the
            neurons' values then stand still.

    Raises:
        ValueError: For an environment that is not highway-env's, an unknown camera or parameter, a rate that
            does not divide, or frames of different shapes with `include_frame`.

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
        camera: Any = "fovea",
        params: Any = None,
        fps: float | None = None,
        include_frame: bool = False,
        include_base: bool = False,
        trace: bool = False,
    ) -> None:
        RecordConstructorArgs.__init__(
            self,
            camera=_plain(camera),
            params=_plain(params),
            fps=fps,
            include_frame=include_frame,
            include_base=include_base,
            trace=trace,
        )
        gym.Wrapper.__init__(self, env)
        check_highway(env)
        self.params = as_params(params)
        self.camera = camera
        self.include_frame, self.include_base, self.trace = include_frame, include_base, trace
        self._fps_wish = fps
        self._response: Response | None = None
        self._seen: list[TraceFrame] = []
        self._substeps, self._heading = 0, 0.0
        self.rendering_paused = False
        self._set_rate()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Reset the environment and the neurons, and show them the first frame."""
        base, info = self.env.reset(seed=seed, options=options)
        if self._host.config["simulation_frequency"] != self._simulation_frequency:
            self._set_rate()
        self.sensors.reset()
        self.sensors.fit(self._host)
        on_road_step(self.env, self._on_substep)
        self._substeps, self._seen, self.rendering_paused = 0, [], False
        self._see()
        self._heading = float(self._host.vehicle.heading)
        return self._observation(base, 0.0), self._informed(info)

    def step(self, action: Any) -> tuple[dict[str, Any], Any, bool, bool, dict[str, Any]]:
        """Step the environment; the neurons see every camera frame on the way."""
        self._seen = []
        substeps, heading = self._substeps, self._heading
        base, reward, terminated, truncated, info = self.env.step(action)
        self._heading = float(self._host.vehicle.heading)
        rate = yaw_rate(self._heading, heading, (self._substeps - substeps) / self._simulation_frequency)
        return self._observation(base, rate), reward, terminated, truncated, self._informed(info)

    def close(self) -> None:
        """Close the cameras that hold resources, then the environment."""
        self.sensors.close()
        super().close()

    @property
    def frames(self) -> dict[str, np.ndarray]:
        """The last frame of each camera by name, uint8 (height, width); overwritten by the next one."""
        return {
            name: self.sensors.of_camera(self._frames, index) for index, name in enumerate(self.sensors.names)
        }

    @property
    def response(self) -> Response:
        """The neurons' answer to the last camera frame, arrays of shape (cameras,)."""
        return Response(*(field[0] for field in self._answered()))

    @property
    def _host(self) -> Any:
        """The highway-env environment underneath."""
        return self.env.unwrapped

    def _set_rate(self) -> None:
        """Build sensors and space for the simulation's present frequency."""
        self._simulation_frequency = self._host.config["simulation_frequency"]
        self.fps = camera_rate(self._fps_wish, self._simulation_frequency)
        self._stride = round(self._simulation_frequency / self.fps)
        self.sensors = SensorArray(self.camera, self.fps, self.params)
        self._frames = self.sensors.empty_frames()
        base = self.env.observation_space if self.include_base else None
        self.observation_space = make_space(
            self.sensors, self.params, self.fps, self._simulation_frequency, self.include_frame, base
        )

    def _on_substep(self) -> None:
        self._substeps += 1
        if self._substeps % self._stride == 0:
            self._see()

    def _see(self) -> None:
        if self.rendering_paused:
            return
        self.sensors.render(self._host, self._frames)
        self._response = self.sensors.step(self._frames)
        if self.trace:
            time = self._substeps / self._simulation_frequency
            self._seen.append(TraceFrame(time, float(self._host.vehicle.speed), self.response))

    def _answered(self) -> Response:
        if self._response is None:
            raise RuntimeError("no frame was seen yet; call reset first")
        return self._response

    def _observation(self, base: Any, rate: float) -> dict[str, Any]:
        observation: dict[str, Any] = dict(signals(self._answered(), 0))
        observation["ego_speed"] = np.array([self._host.vehicle.speed], dtype=np.float32)
        observation["ego_yaw_rate"] = np.array([rate], dtype=np.float32)
        if self.include_frame:
            observation["frame"] = np.stack(list(self.frames.values()), axis=-1)
        if self.include_base:
            observation["base"] = base
        return observation

    def _informed(self, info: dict[str, Any]) -> dict[str, Any]:
        info = info | signal_info(self._answered(), 0, self.sensors.names)
        if self.trace:
            info["lgmd/trace"] = self._seen
        return info


def as_params(params: Any) -> LGMDParams:
    """Return neuron parameters from parameters, the dict of some, or None for the paper's."""
    if params is None:
        return LGMDParams()
    return params if isinstance(params, LGMDParams) else LGMDParams.from_dict(params)


def _plain(value: Any) -> Any:
    """Return a camera or params argument as what JSON gives back, so that a spec survives the round trip."""
    if isinstance(value, CameraParams):
        value = asdict(value)
    elif isinstance(value, LGMDParams):
        value = value.to_dict()
    elif isinstance(value, list | tuple):
        value = [_plain(item) for item in value]
    return json.loads(json.dumps(value))
