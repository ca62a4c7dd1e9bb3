"""LGMDObservation for a `SyncVectorEnv`: the neurons of all environments are stepped in one call."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space

from lgmd_gym.camera import CameraSpec
from lgmd_gym.errors import check_flags
from lgmd_gym.neuron import LGMDParams, NeuronSpec, Response
from lgmd_gym.neuron.validation import checked_threads
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.frame_recorder import FrameRecorder
from lgmd_gym.sensing.road_hook import check_highway_env
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import SIGNALS, make_space, signal_keys
from lgmd_gym.wrappers.observation import LGMDObservation as SingleObservation


class LGMDObservation(VectorWrapper):
    """Observe LGMD neurons, one per environment and camera, that are stepped together.

    Observation space and ``lgmd/`` info keys are those of `lgmd_gym.LGMDObservation`, batched and without
    ``lgmd/trace``. The environments are stepped one after the other; the last frames of their decisions are
    then drawn and processed together. All autoreset modes are supported. In SAME_STEP mode, ``final_obs`` and
    ``final_info`` hold the outputs before the reset.

    Args:
        env: A `SyncVectorEnv` of highway-env environments without cameras; create environments of this
            package with ``camera=None``.
        camera: See `lgmd_gym.LGMDObservation`.
        params: See `lgmd_gym.LGMDObservation`.
        fps: See `lgmd_gym.LGMDObservation`.
        include_frame: See `lgmd_gym.LGMDObservation`.
        include_base: See `lgmd_gym.LGMDObservation`.
        threads: Number of threads that draw and process the frames; None for the calling thread only.

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
        simulation_frequency = _check_envs(env)
        super().__init__(env)
        check_flags(include_frame=include_frame, include_base=include_base)
        assert isinstance(env, SyncVectorEnv)
        self.params = LGMDParams.make(params)
        self.include_frame, self.include_base = include_frame, include_base
        self.fps = camera_rate(fps, simulation_frequency)
        self.sensors = SensorArray(camera, self.fps, self.params, self.num_envs, checked_threads(threads))
        self._info_keys = signal_keys(self.sensors.names)
        self._pending = np.zeros(self.num_envs, np.bool_)
        stride = round(simulation_frequency / self.fps)
        self._recorders = [
            FrameRecorder(single, self.sensors, index, stride, self._pending, include_frame)
            for index, single in enumerate(env.envs)
        ]
        env.envs[:] = self._recorders
        base: Any = env.single_observation_space if include_base else None
        self.single_observation_space = make_space(
            self.sensors, self.params, self.fps, simulation_frequency, include_frame, base
        )
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Reset all environments, or those selected by ``options["reset_mask"]``."""
        base, infos = self.env.reset(seed=seed, options=options)
        self._process_pending()
        return self._observation(base), infos | self._info_arrays(self.sensors.responses)

    def step(self, actions: Any) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Step all environments and process their camera frames."""
        base, rewards, terminated, truncated, infos = self.env.step(actions)
        self._process_pending()
        if "final_obs" in infos:
            self._extend_final(infos)
        infos = infos | self._info_arrays(self.sensors.responses)
        return self._observation(base), rewards, terminated, truncated, infos

    def close(self, **arguments: Any) -> None:
        """Close the cameras, then the environments."""
        self.sensors.close()
        super().close(**arguments)

    def _process_pending(self) -> None:
        self.sensors.step(self._pending)
        self._pending[:] = False

    def _observation(self, base: Any) -> dict[str, Any]:
        signals = self.sensors.signals.astype(np.float32)
        observation: dict[str, Any] = {name: signals[:, row].copy() for row, name in enumerate(SIGNALS)}
        motions = np.array([recorder.motion for recorder in self._recorders], dtype=np.float32)
        observation["ego_speed"], observation["ego_yaw_rate"] = motions[:, :1].copy(), motions[:, 1:].copy()
        if self.sensors.known_decelerations is not None:
            observation["known_deceleration"] = self.sensors.known_decelerations.astype(np.float32)
        if any(self.sensors.columns):
            observation["column_potential"] = self.sensors.column_potentials().astype(np.float32)
        if self.include_frame:  # all cameras have the same shape
            observation["frame"] = self.sensors.stacked_frames().transpose(0, 2, 3, 1).copy()
        if self.include_base:
            observation["base"] = base
        return observation

    def _extend_final(self, infos: dict[str, Any]) -> None:
        """Write the outputs at the end of episodes into ``final_obs`` and ``final_info``."""
        ended = infos["_final_obs"]
        for index in np.flatnonzero(ended):
            final = dict(self._recorders[index].final_observation)
            if self.include_base:
                final["base"] = infos["final_obs"][index]
            infos["final_obs"][index] = final
        rows = [recorder.final_response for recorder in self._recorders]
        responses = Response(*(np.stack(field) for field in zip(*rows, strict=True)))
        infos["final_info"] |= self._info_arrays(responses, ended)

    def _info_arrays(self, responses: Response, valid: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return the ``lgmd/`` keys and their masks in the format of Gymnasium's vector infos.

        Args:
            responses: Arrays of shape (num_envs, cameras).
            valid: Environments with outputs, bool, shape (num_envs,); None for all.
        """
        valid = np.ones(self.num_envs, np.bool_) if valid is None else valid
        arrays = {
            key: np.where(valid, getattr(responses, signal)[:, camera], 0.0)
            for signal, keys in self._info_keys.items()
            for camera, key in enumerate(keys)
        }
        arrays["lgmd/alert"] = responses.alert.any(axis=1) & valid
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
