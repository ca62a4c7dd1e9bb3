"""`LGMDObservation` for an in-process vector of environments: all their neurons in one call."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import SyncVectorEnv, VectorEnv, VectorWrapper
from gymnasium.vector.utils import batch_space

from lgmd_gym.neuron import Response
from lgmd_gym.sensing.frame_buffer import FrameBuffer, FrameRecorder, Motion
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.road_hook import check_highway
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.sensing.spaces import SIGNALS, make_space, signals
from lgmd_gym.wrappers.observation import LGMDObservation as SingleObservation
from lgmd_gym.wrappers.observation import as_params


class LGMDObservation(VectorWrapper):
    """Observe the spike frequencies of one LGMD per environment and camera, stepped together.

    The frames of a decision are queued while the environments play one after the other; then every queued
    frame number is one batched neuron step. Observations and the `lgmd/` keys of infos are those of
    `lgmd_gym.LGMDObservation`, batched, without `lgmd/trace`. All autoreset modes work; in SAME_STEP,
    `final_obs` and `final_info` hold what the neurons said before the reset.

    Args:
        env: A `SyncVectorEnv` of highway-env environments without an eye of their own; ours come so with
            `camera=None`.
        camera: See `lgmd_gym.LGMDObservation`.
        params: See there.
        fps: See there.
        include_frame: See there.
        include_base: See there.
        threads: Threads of a neuron step; None for none beside the caller's.

    Raises:
        ValueError: For another kind of vector environment, environments that are not highway-env's, that
            have an eye already, or of different simulation frequencies.

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
        camera: Any = "fovea",
        params: Any = None,
        fps: float | None = None,
        include_frame: bool = False,
        include_base: bool = False,
        threads: int | None = None,
    ) -> None:
        super().__init__(env)
        simulation_frequency = _check_envs(env)
        assert isinstance(env, SyncVectorEnv)
        self.params = as_params(params)
        self.include_frame, self.include_base = include_frame, include_base
        self.fps = camera_rate(fps, simulation_frequency)
        self.sensors = SensorArray(camera, self.fps, self.params, self.num_envs, threads)
        self._queue = FrameBuffer(self.sensors)
        stride = round(simulation_frequency / self.fps)
        self._recorders = [
            FrameRecorder(one, self._queue, index, stride) for index, one in enumerate(env.envs)
        ]
        env.envs[:] = self._recorders
        self._response: Response = self.sensors.step(self._queue.first, np.zeros(self.num_envs, np.bool_))
        base = env.single_observation_space if include_base else None
        self.single_observation_space = make_space(
            self.sensors, self.params, self.fps, simulation_frequency, include_frame, base
        )
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)

    def reset(
        self, *, seed: Any = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Reset all environments, or those that `options["reset_mask"]` chooses."""
        self._begin()
        base, infos = self.env.reset(seed=seed, options=options)
        self._see_first()
        return self._observation(base), self._informed(infos)

    def step(self, actions: Any) -> tuple[dict[str, Any], np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Step all environments; the neurons see every camera frame on the way."""
        self._begin()
        base, rewards, terminated, truncated, infos = self.env.step(actions)
        self._see_queue()
        if "final_obs" in infos:
            self._finish(infos)
        self._see_first()
        return self._observation(base), rewards, terminated, truncated, self._informed(infos)

    def close(self, **arguments: Any) -> None:
        """Close the cameras that hold resources, then the environments."""
        self.sensors.close()
        super().close(**arguments)

    def _begin(self) -> None:
        for tap in self._recorders:
            tap.begin()

    def _see_queue(self) -> None:
        """Show the neurons the decision's frames, one frame number of all environments at a time."""
        counts = np.array([tap.frames for tap in self._recorders])
        for turn in range(counts.max()):
            self._show(self._queue.turn(turn), turn < counts)

    def _see_first(self) -> None:
        """Have the neurons of environments that were reset forget, and show them the first frame."""
        was_reset = np.array([tap.was_reset for tap in self._recorders])
        if was_reset.any():
            self.sensors.reset(was_reset)
            self._show(self._queue.first, was_reset)

    def _show(self, frames: list[np.ndarray], active: np.ndarray) -> None:
        self._response = self.sensors.step(frames, active)
        if self.include_frame:
            for kept, new in zip(self._queue.shown, frames, strict=True):
                kept[active] = new[active]

    def _observation(self, base: Any) -> dict[str, Any]:
        """Return the batched observation of the present state."""
        rows = [self._row(index, tap.motion) for index, tap in enumerate(self._recorders)]
        observation: dict[str, Any] = {key: np.stack([row[key] for row in rows]) for key in rows[0]}
        if self.include_base:
            observation["base"] = base
        return observation

    def _row(self, index: int, motion: Motion) -> dict[str, Any]:
        """Return one environment's observation, less its base."""
        row: dict[str, Any] = dict(signals(self._response, index))
        row["ego_speed"] = np.array([motion.speed], dtype=np.float32)
        row["ego_yaw_rate"] = np.array([motion.yaw_rate], dtype=np.float32)
        if self.include_frame:
            cameras = range(len(self.sensors.names))
            shown = [self.sensors.of_camera(self._queue.shown, camera, index) for camera in cameras]
            row["frame"] = np.stack(shown, axis=-1)
        return row

    def _informed(self, infos: dict[str, Any]) -> dict[str, Any]:
        return infos | self._info_arrays(np.ones(self.num_envs, dtype=np.bool_))

    def _finish(self, infos: dict[str, Any]) -> None:
        """Put what the neurons say at the end of an episode into `final_obs` and `final_info`."""
        ended = infos["_final_obs"]
        for index in np.flatnonzero(ended):
            final = self._row(int(index), self._recorders[index].final)
            if self.include_base:
                final["base"] = infos["final_obs"][index]
            infos["final_obs"][index] = final
        infos["final_info"] |= self._info_arrays(ended)

    def _info_arrays(self, valid: np.ndarray) -> dict[str, np.ndarray]:
        """Return the `lgmd/` keys and their masks, as Gymnasium batches floats."""
        arrays = {
            f"lgmd/{camera}/{name}": np.where(valid, getattr(self._response, name)[:, index], 0.0)
            for name in SIGNALS
            for index, camera in enumerate(self.sensors.names)
        }
        arrays["lgmd/alert"] = self._response.alert.any(axis=1) & valid
        return arrays | {f"_{key}": valid.copy() for key in arrays}


def _check_envs(env: VectorEnv) -> float:
    """Return the simulation frequency [Hz] of a vector of environments, or refuse it with the mend."""
    if not isinstance(env, SyncVectorEnv):
        raise ValueError(
            f"the batched LGMDObservation needs a SyncVectorEnv, got {type(env).__name__}; "
            "for worker processes wrap inside the worker: lgmd_gym.LGMDObservation around each environment"
        )
    rates = set()
    for one in env.envs:
        check_highway(one)
        layer: Any = one
        while isinstance(layer, gym.Wrapper):
            if isinstance(layer, SingleObservation | FrameRecorder):
                raise ValueError("the environments have an eye already; make them with camera=None")
            layer = layer.env
        rates.add(layer.config["simulation_frequency"])
    if len(rates) > 1:
        raise ValueError(f"environments of one vector need one simulation_frequency, got {sorted(rates)} Hz")
    return rates.pop()
