# pyright: standard
# Not strict: Gymnasium and stable-baselines3 state few types.
"""`BrakingVectorEnv`: the compiled vector environment of all braking scenarios."""

import copy as copying
from collections.abc import Mapping, Sequence
from typing import Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike

from lgmd_gym.aliases import Arguments, Config, Info, Observation
from lgmd_gym.engine.batch import BrakingBatch
from lgmd_gym.engine.episodes import Prepared
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import make_source
from lgmd_gym.errors import (
    check_flags,
    check_keys,
    check_known,
    check_mapping,
    check_whole,
    is_integer,
    shown,
)
from lgmd_gym.neuron import NeuronSpec
from lgmd_gym.neuron.validation import MAX_THREADS
from lgmd_gym.sensing.channel import LGMD, ChannelSpec

_NAMES = (
    *("num_envs", "camera", "neuron", "params", "fps", "include_frame", "include_base", "trace", "config"),
    *("render_mode", "max_episode_steps", "threads", "autoreset_mode", "copy"),
)
_PER_ENV = ("scenario", "scene", "brake", "np_random", "np_random_seed")

MAX_ENVS = 65536
_MODES = {mode.value for mode in AutoresetMode}


class BrakingVectorEnv(VectorEnv):
    """N braking environments of one family, with cameras and neurons, stepped in compiled code.

    Observations, rewards, flags, infos and final observations equal those of a `SyncVectorEnv` of single
    environments with the same seeds and actions; see `BrakingEnv` and `LGMDObservation` for their meaning.
    `gym.make_vec("LGMD/CCRs-v0", num_envs=64)` makes this environment, and
    `gym.make_vec(…, vectorization_mode="sync")` the vector of single environments.

    Physics, cameras and neurons of all environments run without the GIL; Python is called a few times per
    step and thread. With more than one thread, the next episode of each environment is drawn ahead in the
    background.

    Args:
        num_envs: Number of environments N.
        family: A scenario family, or "RandomBraking"; set by the environment id.
        camera: See `LGMDObservation`; None for no camera, so that observations are those of `BrakingEnv`.
        neuron: See `LGMDObservation`.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        config: Configuration of `BrakingEnv`, for all environments.
        render_mode: None or "rgb_array" (highway-env's top view of every environment).
        max_episode_steps: Number of decisions after which episodes are truncated, >= 1, as by Gymnasium's
            `TimeLimit`; None for the durations of the scenarios only.
        threads: Number of threads of a step, including the calling one.
        autoreset_mode: Gymnasium's autoreset mode: "NextStep", "SameStep" or "Disabled".
        copy: Whether observations are new arrays; if not, the next step overwrites them.
        **arguments: See `lgmd_gym.envs.registration.make_braking`.

    Raises:
        ValueError: If an argument, key or name is unknown, or a value is out of range.

    Example:
        >>> import gymnasium as gym, lgmd_gym
        >>> envs = gym.make_vec("LGMD/CCRs-v0", num_envs=3)
        >>> observations, infos = envs.reset(seed=1)
        >>> observations["spike_frequency"].shape
        (3, 1)
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        family: str,
        camera: ChannelSpec | None = "fovea",
        neuron: str = LGMD,
        params: NeuronSpec = None,
        fps: float | None = None,
        include_frame: bool = False,
        include_base: bool = False,
        trace: bool = False,
        config: Config | None = None,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        threads: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        **arguments: Any,
    ) -> None:
        self.num_envs = check_whole("num_envs", num_envs, 1, MAX_ENVS)
        threads = check_whole("threads", threads, 1, MAX_THREADS)
        self._family, self._arguments = family, arguments
        source = make_source(family, arguments, _NAMES)
        self.max_episode_steps = max_episode_steps
        if max_episode_steps is not None:
            check_whole("max_episode_steps", max_episode_steps, 1)
        check_flags(include_frame=include_frame, include_base=include_base, trace=trace, copy=copy)
        if render_mode is not None and not (isinstance(render_mode, str) and render_mode == "rgb_array"):
            raise ValueError(
                f"render_mode must be None or 'rgb_array' for a vector, got {shown(render_mode)}"
            )
        self.batch = batch = BrakingBatch(
            [source] * self.num_envs,
            config,
            camera,
            neuron,
            params,
            fps,
            include_frame=include_frame,
            include_base=include_base,
            trace=trace,
            threads=threads,
        )
        self.simulation = batch.simulation
        self.render_mode, self.copy = render_mode, copy
        self.metadata = {**batch.single.metadata, "autoreset_mode": _autoreset_mode(autoreset_mode)}
        self.single_action_space = copying.deepcopy(batch.single.action_space)
        self.single_observation_space = batch.space
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self._observations = None if copy else batch.empty()
        self._ended = np.zeros(self.num_envs, np.bool_)
        self._elapsed = np.zeros(self.num_envs, np.int64)  # decisions of the present episodes

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: Arguments | None = None
    ) -> tuple[Any, Info]:
        """Reset all environments, or those selected by ``options["reset_mask"]``.

        Args:
            seed: Seed of the first environment; the others get the following numbers. Or one seed per
                environment. None continues their random generators.
            options: None, or ``reset_mask``, bool, shape (num_envs,).

        Raises:
            ValueError: If the seeds or the mask have another length, or an option is unknown.
        """
        options = check_mapping("options", options)
        check_keys("option", options, ("reset_mask",))
        mask = _mask_of(options.get("reset_mask"), self.num_envs)
        for index, value in enumerate(_seeds_of(seed, self.num_envs)):
            if mask[index]:
                self.batch.queue.seed(index, value)
        self._start(mask)
        self._ended[mask] = False
        return self.read_observations(), self.read_infos(mask)

    def step(self, actions: ArrayLike) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, Info]:
        """Advance all environments by one decision.

        Raises:
            ValueError: If an action is out of range, or an environment that has ended was not reset in
                autoreset mode "Disabled".
            RuntimeError: Before the first reset.
        """
        if None in self.batch.episodes:
            raise RuntimeError("the environments have no episodes: call reset() before step()")
        mode, ended = self.metadata["autoreset_mode"], self._ended
        if mode == AutoresetMode.DISABLED and ended.any():
            raise ValueError(
                f"environments {np.flatnonzero(ended).tolist()} have ended; "
                "call reset(options={'reset_mask': terminated | truncated}) before step()"
            )
        restart = ended if mode == AutoresetMode.NEXT_STEP else np.zeros_like(ended)
        self.advance(self.read_demands(actions), ~restart)
        if restart.any():
            self._start(restart)
        outcome = self.simulation.outcome
        result = outcome.rewards.copy(), outcome.terminated.copy(), outcome.truncated.copy()
        self._ended = result[1] | result[2]
        extra: Info = {}
        if mode == AutoresetMode.SAME_STEP and self._ended.any():
            extra = self._end_episodes(self._ended)
        infos = self.read_infos(np.ones(self.num_envs, np.bool_))
        return self.read_observations(), *result, infos | extra

    def read_demands(self, actions: ArrayLike) -> np.ndarray:
        """Return the longitudinal demands of actions, in [-1, 1], float64, shape (num_envs,).

        With `advance`, `read_observations`, `read_infos` and `reset`, a loop can advance some
        environments for several decisions, as `lgmd_gym.training.PolicyVecEnv` does.

        Raises:
            ValueError: If an action is out of range.
        """
        return self.batch.read_demands(actions)

    def advance(self, demands: np.ndarray, active: np.ndarray, rendering: bool = True) -> None:
        """Advance some environments by one decision; `simulation.outcome` has the results.

        At `max_episode_steps`, episodes are truncated.

        Args:
            demands: Longitudinal demands in [-1, 1], float64, shape (num_envs,).
            active: The environments, bool, shape (num_envs,).
            rendering: Whether the cameras and neurons process their frames.
        """
        self.simulation.step(demands, active, rendering)
        self._elapsed[active] += 1
        if self.max_episode_steps is not None:
            self.simulation.outcome.truncated[active & (self._elapsed >= self.max_episode_steps)] = True

    def read_observations(self) -> Any:
        """Return the present observations of all environments."""
        return self.batch.observations(self._observations)

    def read_infos(self, selected: np.ndarray) -> Info:
        """Return the infos of the selected environments in the format of Gymnasium's vector environments.

        Every key `k` has an array of shape (num_envs,), with 0, False or None in other environments, and a
        mask `_k` of the environments that have it.

        Args:
            selected: The environments, bool, shape (num_envs,).
        """
        arrays, traces = self.batch.infos(), self.batch.traces
        if traces is not None:
            arrays["lgmd/trace"] = np.full(self.num_envs, None, dtype=object)
            for index in np.flatnonzero(selected).tolist():
                arrays["lgmd/trace"][index] = traces.take(index)
        infos: Info = {key: _only(values, selected) for key, values in arrays.items()}
        return infos | {f"_{key}": selected.copy() for key in arrays}

    def scenario_of(self, index: int) -> Scenario:
        """Return the scenario of environment `index`.

        Raises:
            RuntimeError: Before its first reset.
        """
        return self._episode(index, "scenario_of()").draw.placement.scenario

    def set_arguments(
        self, arguments: Arguments | Sequence[Arguments | None], selected: np.ndarray | None = None
    ) -> None:
        """Change arguments of the scenario family from the next episodes on, for example for a curriculum.

        Args:
            arguments: Arguments such as `ego_speed`, or `start_level` and `num_levels` of random levels; the
                others stay those of the construction. Or one mapping per environment, None to change nothing.
            selected: Environments, bool, shape (num_envs,); None for all.

        Raises:
            ValueError: If an argument is unknown or out of range; then nothing changes.

        Example:
            >>> import gymnasium as gym, lgmd_gym
            >>> envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2)
            >>> envs.unwrapped.set_arguments([{"ego_speed": 5.0}, {"ego_speed": 15.0}])
            >>> envs.reset(seed=0)[1]["ego_speed"].tolist()
            [5.0, 15.0]
        """
        mask = _mask_of(selected, self.num_envs, "selected")
        if not isinstance(arguments, Mapping | list | tuple):
            raise ValueError(f"arguments must be a mapping or a list of mappings, got {shown(arguments)}")
        given = [arguments] * self.num_envs if isinstance(arguments, Mapping) else list(arguments)
        if len(given) != self.num_envs:
            raise ValueError(f"arguments must be one mapping or {self.num_envs} mappings, got {len(given)}")
        chosen = [index for index in np.flatnonzero(mask).tolist() if given[index] is not None]
        sources = [
            make_source(self._family, self._arguments | check_mapping("arguments", given[index]), _NAMES)
            for index in chosen
        ]
        for index, source in zip(chosen, sources, strict=True):
            self.batch.queue.assign(index, source)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """Return an attribute of every environment.

        Args:
            name: "scenario", "scene" or "brake" of the present episodes, "np_random" or "np_random_seed"; or
                an attribute that all environments share, such as "render_mode".

        Raises:
            AttributeError: If the environments have no such attribute.
            RuntimeError: For an attribute of an episode before the first reset.
        """
        if name in ("np_random", "np_random_seed"):
            return getattr(self, name)
        if name in _PER_ENV:
            return tuple(self._attribute_of(index, name) for index in range(self.num_envs))
        if name in ("action_space", "observation_space"):
            name = f"single_{name}"
        if name.startswith("_") or callable(getattr(self, name, len)):  # methods belong to the vector
            raise AttributeError(f"the environments have no attribute {name!r}; known: {', '.join(_PER_ENV)}")
        return (getattr(self, name),) * self.num_envs

    def call(self, name: str, *args: object, **kwargs: object) -> tuple[Any, ...]:
        """Return the results of a method of every environment: "render", or those of `get_attr`.

        Raises:
            AttributeError: For another method; see `get_attr`.
        """
        if name == "render" and not args and not kwargs:
            return self.render() or (None,) * self.num_envs
        if args or kwargs or name in ("reset", "step", "close"):
            raise AttributeError(
                f"the environments share compiled state and have no method {name!r} of their own; "
                "use the method of the vector, or set_arguments"
            )
        return self.get_attr(name)

    def set_attr(self, name: str, values: object) -> None:
        """Refuse to set an attribute.

        Raises:
            AttributeError: Always; an attribute would have no effect.
        """
        raise AttributeError(
            f"the environments share compiled state and have no attribute {name!r} to set; use set_arguments"
        )

    def render(self) -> tuple[Any, ...] | None:
        """Return highway-env's top view of every environment, uint8, (height, width, 3), or None.

        Raises:
            RuntimeError: Before the first reset.
        """
        if self.render_mode is None:
            return None
        if None in self.batch.episodes:
            raise RuntimeError("the environments have no episodes: call reset() before render()")
        return tuple(self.batch.show(index).render() for index in range(self.num_envs))

    def close_extras(self, **kwargs: object) -> None:
        """Stop background threads and close the cameras."""
        self.batch.close()

    @property
    def np_random(self) -> tuple[np.random.Generator | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Random generators of the environments."""
        return tuple(self.batch.queue.generators)

    @property
    def np_random_seed(self) -> Any:
        """Last seeds of the environments."""
        return tuple(self.batch.queue.seeds)

    def _episode(self, index: int, what: str) -> Prepared:
        prepared = self.batch.episodes[index]
        if prepared is None:
            raise RuntimeError(f"the environments have no episodes: call reset() before {what}")
        return prepared

    def _attribute_of(self, index: int, name: str) -> object:
        """Return an attribute of the present episode of environment `index`; see `get_attr`."""
        draw = self._episode(index, name).draw
        if name == "brake":
            return self.batch.single.episode_brake(draw.brake)
        return draw.scene if name == "scene" else draw.placement.scenario

    def _start(self, selected: np.ndarray) -> None:
        self.batch.start(selected)
        self._elapsed[selected] = 0

    def _end_episodes(self, ended: np.ndarray) -> Info:
        """Restart environments at once; returns their final observations and infos."""
        batch = self.batch.observations()
        final = np.full(self.num_envs, None, dtype=object)
        for index in np.flatnonzero(ended).tolist():
            final[index] = _item(batch, index)
        infos = {"final_obs": final, "final_info": self.read_infos(ended)}
        self._start(ended)
        return infos | {f"_{key}": ended.copy() for key in infos}


def _item(batch: Any, index: int) -> Any:
    if isinstance(batch, dict):
        return {key: value[index] for key, value in cast(Observation, batch).items()}
    return batch[index]


def _only(values: np.ndarray, selected: np.ndarray) -> np.ndarray:
    """Return a copy with the values of other environments set to 0, False or None."""
    empty = np.full(values.shape, None, dtype=object) if values.dtype == object else np.zeros_like(values)
    empty[selected] = values[selected]
    return empty


def _autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    """Return an autoreset mode; raise ValueError for an unknown one."""
    if isinstance(mode, AutoresetMode):
        return mode
    return AutoresetMode(check_known("autoreset_mode", mode, _MODES))


def _seeds_of(seed: object, num_envs: int) -> list[int | None]:
    """Return one seed per environment; raise ValueError for another number of seeds, or an invalid seed."""
    if seed is None:
        return [None] * num_envs
    seeds = [seed + index for index in range(num_envs)] if is_integer(seed) else seed
    seeds = seeds.tolist() if isinstance(seeds, np.ndarray) else seeds
    if not isinstance(seeds, Sequence) or len(seeds) != num_envs:
        raise ValueError(f"seed must be one number or {num_envs} numbers, got {shown(seed)}")
    for value in seeds:
        if value is not None and (not is_integer(value) or value < 0):
            raise ValueError(f"seed must be None or integers >= 0, got {shown(value)}")
    return [None if value is None else int(value) for value in seeds]


def _mask_of(mask: object, num_envs: int, name: str = "options['reset_mask']") -> np.ndarray:
    """Return a selection of environments, bool, shape (num_envs,); None selects all.

    Raises:
        ValueError: If the mask has another type or shape, or selects no environment.
    """
    if mask is None:
        return np.ones(num_envs, np.bool_)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (num_envs,):
        raise ValueError(f"{name} must be a bool array of shape ({num_envs},), got {shown(mask)}")
    if not mask.any():
        raise ValueError(f"{name} must select at least one environment, got none")
    return mask
