"""LGMDObservation for a `SyncVectorEnv`: the neurons of all environments are stepped in one call."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space

from lgmd_gym.camera import CameraSpec
from lgmd_gym.neuron import LGMDParams, NeuronSpec, Response
from lgmd_gym.sensing.frame_buffer import EgoMotion, FrameBuffer, FrameRecorder
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.road_hook import check_highway_env
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import SIGNALS, make_space, signal_arrays
from lgmd_gym.wrappers.observation import LGMDObservation as SingleObservation


class LGMDObservation(VectorWrapper):
    """Observe LGMD neurons, one per environment and camera, that are stepped together.

    Observation space and ``lgmd/`` info keys are those of `lgmd_gym.LGMDObservation`, batched and without
    ``lgmd/trace``. The environments are stepped one after the other into a frame buffer; each frame index of
    the decision is then one batched neuron step. All autoreset modes are supported. In SAME_STEP mode,
    ``final_obs`` and ``final_info`` hold the outputs before the reset.

    Args:
        env: A `SyncVectorEnv` of highway-env environments without cameras; create environments of this
            package with ``camera=None``.
        camera: See `lgmd_gym.LGMDObservation`.
        params: See `lgmd_gym.LGMDObservation`.
        fps: See `lgmd_gym.LGMDObservation`.
        include_frame: See `lgmd_gym.LGMDObservation`.
        include_base: See `lgmd_gym.LGMDObservation`.
        threads: Number of threads of a neuron step; None for the calling thread only.

    Raises:
        ValueError: If `env` is not a `SyncVectorEnv`, or its environments are not highway-env environments,
            have cameras already, or have different simulation frequencies.

    Example:
        >>> import gymnasium as gym, lgmd_gym
        >>> from lgmd_gym.wrappers.vector import LGMDObservation
        >>> envs = gym.make_vec("LGMD/CCRs-v0", num_envs=3, vectorization_mode="sync", camera=None)
        >>> observation, info = LGMDObservation(envs).reset(seed=1)
        >>> observation["spike_frequency"].shape
        (3, 1)
    """

    def __init__(
        self,
        env: VectorEnv,
        camera: CameraSpec = "fovea",
        params: NeuronSpec = None,
        fps: float | None = None,
        include_frame: bool = False,
        include_base: bool = False,
        threads: int | None = None,
    ) -> None:
        super().__init__(env)
        simulation_frequency = _check_envs(env)
        assert isinstance(env, SyncVectorEnv)
        self.params = LGMDParams.make(params)
        self.include_frame, self.include_base = include_frame, include_base
        self.fps = camera_rate(fps, simulation_frequency)
        self.sensors = SensorArray(camera, self.fps, self.params, self.num_envs, threads)
        self._buffer = FrameBuffer(self.sensors)
        stride = round(simulation_frequency / self.fps)
        self._recorders = [
            FrameRecorder(single, self._buffer, index, stride) for index, single in enumerate(env.envs)
        ]
        env.envs[:] = self._recorders
        self._response = self.sensors.step(self._buffer.reset_frames, np.zeros(self.num_envs, np.bool_))
        base: Any = env.single_observation_space if include_base else None
        self.single_observation_space = make_space(
            self.sensors, self.params, self.fps, simulation_frequency, include_frame, base
        )
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Reset all environments, or those selected by ``options["reset_mask"]``."""
        self._start_decision()
        base, infos = self.env.reset(seed=seed, options=options)
        self._process_reset_frames()
        return self._observation(base), self._extend_infos(infos)

    def step(self, actions: Any) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Step all environments and process their camera frames."""
        self._start_decision()
        base, rewards, terminated, truncated, infos = self.env.step(actions)
        self._process_recorded_frames()
        if "final_obs" in infos:
            self._extend_final(infos)
        self._process_reset_frames()
        return self._observation(base), rewards, terminated, truncated, self._extend_infos(infos)

    def close(self, **arguments: Any) -> None:
        """Close the cameras, then the environments."""
        self.sensors.close()
        super().close(**arguments)

    def _start_decision(self) -> None:
        for recorder in self._recorders:
            recorder.start_decision()

    def _process_recorded_frames(self) -> None:
        """Process the frames of the decision: one batched step per frame index."""
        counts = np.array([recorder.frame_count for recorder in self._recorders])
        for index in range(counts.max()):
            self._process(self._buffer.slot(index), index < counts)

    def _process_reset_frames(self) -> None:
        """Reset the neurons of environments that were reset, and process their first frames."""
        was_reset = np.array([recorder.was_reset for recorder in self._recorders])
        if was_reset.any():
            self.sensors.reset(was_reset)
            self._process(self._buffer.reset_frames, was_reset)

    def _process(self, frames: list[np.ndarray], active: np.ndarray) -> None:
        self._response: Response = self.sensors.step(frames, active)
        if self.include_frame:
            for last, new in zip(self._buffer.last_frames, frames, strict=True):
                last[active] = new[active]

    def _observation(self, base: Any) -> dict[str, Any]:
        rows = [self._row(index, recorder.motion) for index, recorder in enumerate(self._recorders)]
        observation: dict[str, Any] = {key: np.stack([row[key] for row in rows]) for key in rows[0]}
        if self.include_base:
            observation["base"] = base
        return observation

    def _row(self, index: int, motion: EgoMotion) -> dict[str, Any]:
        """Return the observation of one environment, except for the key ``base``."""
        row: dict[str, Any] = dict(signal_arrays(self._response, index))
        row["ego_speed"] = np.array([motion.speed], dtype=np.float32)
        row["ego_yaw_rate"] = np.array([motion.yaw_rate], dtype=np.float32)
        if self.include_frame:
            cameras = range(len(self.sensors.names))
            frames = [self.sensors.frame_of(self._buffer.last_frames, camera, index) for camera in cameras]
            row["frame"] = np.stack(frames, axis=-1)
        return row

    def _extend_infos(self, infos: dict[str, Any]) -> dict[str, Any]:
        return infos | self._info_arrays(np.ones(self.num_envs, dtype=np.bool_))

    def _extend_final(self, infos: dict[str, Any]) -> None:
        """Write the outputs at the end of episodes into ``final_obs`` and ``final_info``."""
        ended = infos["_final_obs"]
        for index in np.flatnonzero(ended):
            final = self._row(int(index), self._recorders[index].final_motion)
            if self.include_base:
                final["base"] = infos["final_obs"][index]
            infos["final_obs"][index] = final
        infos["final_info"] |= self._info_arrays(ended)

    def _info_arrays(self, valid: np.ndarray) -> dict[str, np.ndarray]:
        """Return the ``lgmd/`` keys and their masks in the format of Gymnasium's vector infos."""
        arrays = {
            f"lgmd/{camera}/{name}": np.where(valid, getattr(self._response, name)[:, index], 0.0)
            for name in SIGNALS
            for index, camera in enumerate(self.sensors.names)
        }
        arrays["lgmd/alert"] = self._response.alert.any(axis=1) & valid
        return arrays | {f"_{key}": valid.copy() for key in arrays}


def _check_envs(env: VectorEnv) -> float:
    """Return the simulation frequency [Hz]; raise ValueError for unsupported environments."""
    if not isinstance(env, SyncVectorEnv):
        raise ValueError(
            f"env must be a SyncVectorEnv, got {type(env).__name__}; for worker processes, wrap each "
            "environment in lgmd_gym.LGMDObservation instead"
        )
    rates: set[float] = set()
    for single in env.envs:
        check_highway_env(single)
        layer: Any = single
        while isinstance(layer, gym.Wrapper):
            if isinstance(layer, SingleObservation | FrameRecorder):
                raise ValueError(
                    f"environments must have no cameras, got {type(layer).__name__}; use camera=None"
                )
            layer = layer.env
        rates.add(layer.config["simulation_frequency"])
    if len(rates) > 1:
        raise ValueError(f"environments must have one simulation_frequency, got {sorted(rates)} Hz")
    return rates.pop()
