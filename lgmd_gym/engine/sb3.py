# pyright: standard
# Not strict: Gymnasium and stable-baselines3 state few types.
"""`SB3VecEnv`: vector environments of Gymnasium for the algorithms of stable-baselines3."""

import time
from collections.abc import Iterable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv

from lgmd_gym.aliases import Arguments, Info
from lgmd_gym.processes.extras import missing_extra

try:
    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv
    from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs
except ImportError:
    raise ImportError(str(missing_extra("SB3VecEnv", "train"))) from None

Indices = int | Iterable[int] | None
_FINAL = ("final_obs", "final_info")


class EngineVecEnv(VecEnv):
    """Base of the `VecEnv`s of a vector environment: attributes, images and the statistics of episodes.

    Args:
        envs: The vector environment.
        observation_space: Observation space of one environment.
    """

    def __init__(self, envs: VectorEnv, observation_space: spaces.Space) -> None:
        self.envs = envs
        super().__init__(envs.num_envs, observation_space, envs.single_action_space)
        self.metadata = dict(envs.metadata)
        self._actions: Any = None
        self._start_s = time.time()
        self._clear_statistics()

    def step_async(self, actions: np.ndarray) -> None:
        """Set the actions of the next `step_wait`."""
        self._actions = actions

    def _take_seeds(self) -> Any:
        """Return the seeds of a reset of all environments, and start new statistics."""
        if any(self._options):
            raise ValueError(f"the environments have no options, got {self._options}; call set_options()")
        seeds = list(self._seeds)
        self._reset_seeds()
        self._clear_statistics()
        return seeds

    def close(self) -> None:
        """Close the environments."""
        self.envs.close()

    def get_images(self) -> list[np.ndarray | None]:
        """Return the top view of every environment; None without `render_mode`."""
        images: Any = self.envs.render() or [None] * self.num_envs
        return list(images)

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[object]:
        """Return an attribute of the single environments.

        Raises:
            AttributeError: If the vector environment has no such attribute.
        """
        spaces: Arguments = {
            "observation_space": self.observation_space,
            "action_space": self.action_space,
        }
        selected = self._get_indices(indices)
        if attr_name in spaces:
            return [spaces[attr_name] for _ in selected]
        envs: Any = self.envs.unwrapped
        values = envs.get_attr(attr_name)
        return [values[index] for index in selected]

    def set_attr(self, attr_name: str, value: object, indices: Indices = None) -> None:
        """Refuse to set an attribute.

        Raises:
            AttributeError: Always; an attribute would have no effect.
        """
        raise AttributeError(
            f"the environments share compiled state and have no attribute {attr_name!r} to set; "
            "pass arguments to SB3VecEnv, or call env_method('set_arguments', {…})"
        )

    def env_method(
        self, method_name: str, *method_args: object, indices: Indices = None, **method_kwargs: object
    ) -> list[Any]:
        """Call "render", or "set_arguments" with a mapping, see `BrakingVectorEnv.set_arguments`.

        Raises:
            AttributeError: For another method.
        """
        if method_name == "set_arguments":
            selected = np.zeros(self.num_envs, np.bool_)
            selected[list(self._get_indices(indices))] = True
            envs: Any = self.envs.unwrapped
            envs.set_arguments(*method_args, **method_kwargs, selected=selected)
            return [None for _ in self._get_indices(indices)]
        if method_name != "render":
            raise AttributeError(
                f"the environments share compiled state and have no method {method_name!r}; "
                "known: render, set_arguments"
            )
        images = self.get_images()
        return [images[index] for index in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: type[gym.Wrapper], indices: Indices = None) -> list[bool]:
        """Return True for `Monitor`, since infos have ``episode``; False for other wrappers."""
        return [issubclass(Monitor, wrapper_class) for _ in self._get_indices(indices)]

    def _count(self, rewards: np.ndarray) -> None:
        """Add a step of all environments to the statistics."""
        self._returns += rewards
        self._lengths += 1

    def _statistics(self, index: int) -> dict[str, float]:
        """Return the statistics of an ended episode, and start those of the next."""
        total, length = self._returns[index], self._lengths[index]
        self._returns[index] = self._lengths[index] = 0
        return {"r": total, "l": length, "t": round(time.time() - self._start_s, 6)}

    def _clear_statistics(self) -> None:
        self._returns = np.zeros(self.num_envs, np.float32)
        self._lengths = np.zeros(self.num_envs, np.int32)


class SB3VecEnv(EngineVecEnv):
    """The engine as a `VecEnv` of stable-baselines3.

    Steps return what `VecMonitor(DummyVecEnv([…]))` of single environments returns for the same seeds and
    actions: float32 rewards, a list of infos, and for an ended episode the first observation of the next one.
    The info of an ended episode has ``terminal_observation``, ``TimeLimit.truncated`` and ``episode``: the
    sum of rewards `r`, the number of steps `l` and the time since the construction `t` [s]. Its other keys
    are those of the last step; `reset_infos` has those of the reset.

    Args:
        env: An environment id such as "LGMD/RandomBraking-v0", or a Gymnasium vector environment in autoreset
            mode "SameStep".
        num_envs: Number of environments; only with an id.
        **arguments: Arguments of `gym.make_vec`, for example `threads`; only with an id.

    Raises:
        ValueError: If the vector environment has another autoreset mode or does not copy its observations, or
            an argument is given with it.

    Example:
        >>> from stable_baselines3 import PPO
        >>> from lgmd_gym.engine import SB3VecEnv
        >>> envs = SB3VecEnv("LGMD/RandomBraking-v0", num_envs=4)
        >>> PPO("MultiInputPolicy", envs, n_steps=16, batch_size=64).learn(64).num_timesteps
        64
    """

    def __init__(self, env: str | VectorEnv, num_envs: int | None = None, **arguments: Any) -> None:
        if isinstance(env, str):
            env = _make(env, 1 if num_envs is None else num_envs, arguments)
        elif num_envs is not None or arguments:
            names = ", ".join((["num_envs"] if num_envs is not None else []) + list(arguments))
            raise ValueError(
                f"arguments of a vector environment cannot change, got {names}; pass an id instead"
            )
        super().__init__(_checked(env), env.single_observation_space)

    def reset(self) -> VecEnvObs:
        """Reset all environments with the seeds of `seed`, if any; return their observations.

        Raises:
            ValueError: If options were set; the environments have none.
        """
        observations, infos = self.envs.reset(seed=self._take_seeds())
        self.reset_infos = _rows(infos, range(self.num_envs))
        return observations

    def step_wait(self) -> tuple[VecEnvObs, np.ndarray, np.ndarray, list[Info]]:
        """Step all environments; return observations, rewards, ends and infos."""
        observations, rewards, terminated, truncated, arrays = self.envs.step(self._actions)
        rewards, done = rewards.astype(np.float32), terminated | truncated
        infos = _rows(arrays, range(self.num_envs))
        self._count(rewards)
        ended = np.flatnonzero(done).tolist()
        if ended:
            finals = _rows(arrays["final_info"], ended)
            for index, final in zip(ended, finals, strict=True):
                self.reset_infos[index], infos[index] = infos[index], final
                final["terminal_observation"] = arrays["final_obs"][index]
                final["episode"] = self._statistics(index)
        for info, value in zip(infos, (truncated & ~terminated).tolist(), strict=True):
            info["TimeLimit.truncated"] = value
        return observations, rewards, done, infos


def _make(env_id: str, num_envs: int, arguments: Arguments) -> VectorEnv:
    given = arguments.get("autoreset_mode", AutoresetMode.SAME_STEP)
    if given not in (AutoresetMode.SAME_STEP, AutoresetMode.SAME_STEP.value):
        raise ValueError(f"autoreset_mode must be 'SameStep' for stable-baselines3, got {given!r}; omit it")
    settings: Arguments = arguments | {"autoreset_mode": AutoresetMode.SAME_STEP.value}
    return gym.make_vec(env_id, num_envs=num_envs, **settings)


def _checked(env: VectorEnv) -> VectorEnv:
    if not isinstance(env, VectorEnv):
        raise ValueError(
            f"env must be an environment id or a vector environment of Gymnasium, got {type(env).__name__}"
        )
    mode = env.metadata.get("autoreset_mode")
    if mode != AutoresetMode.SAME_STEP:
        raise ValueError(
            f"env must have autoreset_mode 'SameStep', got {getattr(mode, 'value', mode)!r}; "
            "use gym.make_vec(…, autoreset_mode='SameStep')"
        )
    if not getattr(env.unwrapped, "copy", True):
        raise ValueError("env must have copy=True, got False; algorithms keep the last observations")
    return env


def _rows(arrays: Info, indices: Iterable[int]) -> list[Info]:
    """Return the infos of single environments from the arrays of a vector environment."""
    names = [name for name in arrays if f"_{name}" in arrays and name not in _FINAL]
    masks = [arrays[f"_{name}"] for name in names]
    columns = [arrays[name].tolist() for name in names]
    if all(mask.all() for mask in masks):
        rows = list(zip(*columns, strict=True))
        return [dict(zip(names, rows[index], strict=True)) for index in indices]
    return [
        {name: column[index] for name, column, mask in zip(names, columns, masks, strict=True) if mask[index]}
        for index in indices
    ]
