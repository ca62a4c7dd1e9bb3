"""`BrakingVectorEnv`: the compiled vector environment of all braking scenarios."""

import copy as copying
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from lgmd_gym.engine.actions import Demands
from lgmd_gym.engine.arguments import autoreset_mode_of, make_sensors, mask_of, seeds_of
from lgmd_gym.engine.episodes import EpisodeQueue, Prepared
from lgmd_gym.engine.infos import InfoArrays
from lgmd_gym.engine.observations import Observations
from lgmd_gym.engine.simulation import Rates, Simulation
from lgmd_gym.engine.top_view import TopViews
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.families.scenario import Scenario
from lgmd_gym.envs.registration import make_source
from lgmd_gym.errors import check_flags, check_keys, check_mapping, check_whole, shown
from lgmd_gym.neuron import LGMDParams, NeuronSpec
from lgmd_gym.neuron.validation import MAX_THREADS
from lgmd_gym.sensing.channel import LGMD, ChannelSpec
from lgmd_gym.sensing.frame_rate import camera_rate
from lgmd_gym.sensing.spaces import make_space

_NAMES = (
    *("num_envs", "camera", "neuron", "params", "fps", "include_frame", "include_base", "trace", "config"),
    *("render_mode", "threads", "autoreset_mode", "copy"),
)

MAX_ENVS = 65536


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
        config: dict[str, Any] | None = None,
        render_mode: str | None = None,
        threads: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        **arguments: Any,
    ) -> None:
        self.num_envs = check_whole("num_envs", num_envs, 1, MAX_ENVS)
        threads = check_whole("threads", threads, 1, MAX_THREADS)
        source = make_source(family, arguments, _NAMES)
        check_flags(include_frame=include_frame, include_base=include_base, trace=trace, copy=copy)
        if render_mode is not None and not (isinstance(render_mode, str) and render_mode == "rgb_array"):
            raise ValueError(
                f"render_mode must be None or 'rgb_array' for a vector, got {shown(render_mode)}"
            )
        self._single = BrakingEnv(source, config=config)
        self.render_mode, self.copy = render_mode, copy
        mode = autoreset_mode_of(autoreset_mode)
        self.metadata = {**self._single.metadata, "autoreset_mode": mode}
        settings = self._single.config
        rates = Rates(
            simulation=settings["simulation_frequency"],
            policy=settings["policy_frequency"],
            camera=camera_rate(fps, settings["simulation_frequency"]) if camera is not None else 1.0,
        )
        sensors = None
        if camera is not None:
            checked = LGMDParams.make(params)
            sensors = make_sensors(camera, neuron, rates.camera, checked, self.num_envs)
        self.simulation = Simulation(self.num_envs, rates, sensors, settings["throttle"], threads)
        self.simulation.weights[:] = self._single.weights
        self._queue = EpisodeQueue([source] * self.num_envs, ahead=threads > 1)
        self._episodes: list[Prepared | None] = [None] * self.num_envs
        self._demands = Demands(self._single.action_type)
        self._top_views = TopViews(self.simulation, config or {})
        self._make_spaces(include_frame, include_base)
        self._observations = Observations(
            self.simulation, self.single_observation_space, include_frame, include_base, copy
        )
        self._infos = InfoArrays(self.simulation, trace)
        self._ended = np.zeros(self.num_envs, np.bool_)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
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
        mask = mask_of(options.get("reset_mask"), self.num_envs)
        for index, value in enumerate(seeds_of(seed, self.num_envs)):
            if mask[index]:
                self._queue.seed(index, value)
        self._start(mask)
        self._ended[mask] = False
        return self._observations.read(), self._infos.read(mask)

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Advance all environments by one decision.

        Raises:
            ValueError: If an action is out of range, or an environment that has ended was not reset in
                autoreset mode "Disabled".
            RuntimeError: Before the first reset.
        """
        if None in self._episodes:
            raise RuntimeError("the environments have no episodes: call reset() before step()")
        mode, ended = self.metadata["autoreset_mode"], self._ended
        if mode == AutoresetMode.DISABLED and ended.any():
            raise ValueError(
                f"environments {np.flatnonzero(ended).tolist()} have ended; "
                "call reset(options={'reset_mask': terminated | truncated}) before step()"
            )
        restart = ended if mode == AutoresetMode.NEXT_STEP else np.zeros_like(ended)
        self.simulation.step(self.read_demands(actions), ~restart)
        if restart.any():
            self._start(restart)
        outcome = self.simulation.outcome
        result = outcome.rewards.copy(), outcome.terminated.copy(), outcome.truncated.copy()
        self._ended = result[1] | result[2]
        extra: dict[str, Any] = {}
        if mode == AutoresetMode.SAME_STEP and self._ended.any():
            extra = self._end_episodes(self._ended)
        infos = self._infos.read(np.ones(self.num_envs, np.bool_))
        return self._observations.read(), *result, infos | extra

    def read_demands(self, actions: Any) -> np.ndarray:
        """Return the longitudinal demands of actions, in [-1, 1], float64, shape (num_envs,).

        With `simulation.step`, `read_observations`, `read_infos` and `reset`, a loop can advance some
        environments for several decisions, as `lgmd_gym.training.PolicyVecEnv` does.

        Raises:
            ValueError: If an action is out of range.
        """
        return self._demands.read(actions, self.num_envs)

    def read_observations(self) -> Any:
        """Return the present observations of all environments."""
        return self._observations.read()

    def read_infos(self, selected: np.ndarray) -> dict[str, Any]:
        """Return the infos of the selected environments, bool, shape (num_envs,)."""
        return self._infos.read(selected)

    def scenario_of(self, index: int) -> Scenario:
        """Return the scenario of environment `index`.

        Raises:
            RuntimeError: Before its first reset.
        """
        prepared = self._episodes[index]
        if prepared is None:
            raise RuntimeError("the environments have no episodes: call reset() before scenario_of()")
        return prepared.draw.placement.scenario

    def render(self) -> tuple[Any, ...] | None:
        """Return highway-env's top view of every environment, uint8, (height, width, 3), or None.

        Raises:
            RuntimeError: Before the first reset.
        """
        if self.render_mode is None:
            return None
        episodes = [prepared for prepared in self._episodes if prepared is not None]
        if len(episodes) < self.num_envs:
            raise RuntimeError("the environments have no episodes: call reset() before render()")
        return tuple(self._top_views.render(index, prepared) for index, prepared in enumerate(episodes))

    def close_extras(self, **kwargs: Any) -> None:
        """Stop background threads and close the cameras."""
        self._queue.close()
        self._top_views.close()
        if self.simulation.sensors is not None:
            self.simulation.sensors.close()

    @property
    def np_random(self) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        """Random generators of the environments."""
        return tuple(self._queue.generators)

    @property
    def np_random_seed(self) -> Any:
        """Last seeds of the environments."""
        return tuple(self._queue.seeds)

    def _start(self, selected: np.ndarray) -> None:
        """Start new episodes in the selected environments."""
        for index in np.flatnonzero(selected).tolist():
            self._queue.seed(index, None)
            prepared = self._queue.next(index)
            brake = self._single.episode_brake(prepared.draw.brake)
            self.simulation.load(index, prepared.draw, prepared.network, brake)
            self._episodes[index] = prepared
            self._infos.set_episode(index, prepared.draw.info)
        self.simulation.start(selected)

    def _end_episodes(self, ended: np.ndarray) -> dict[str, Any]:
        """Restart environments at once; returns their final observations and infos."""
        batch = self._observations.read(copy=True)
        final = np.full(self.num_envs, None, dtype=object)
        for index in np.flatnonzero(ended).tolist():
            final[index] = _item(batch, index)
        infos = {"final_obs": final, "final_info": self._infos.read(ended)}
        self._start(ended)
        return infos | {f"_{key}": ended.copy() for key in infos}

    def _make_spaces(self, include_frame: bool, include_base: bool) -> None:
        base, rates, sensors = self._single.observation_space, self.simulation.rates, self.simulation.sensors
        self.single_action_space = copying.deepcopy(self._single.action_space)
        self.single_observation_space = cast(gym.Space, base)
        if sensors is not None:
            included = base if include_base else None
            self.single_observation_space = make_space(sensors, rates.simulation, include_frame, included)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)


def _item(batch: Any, index: int) -> Any:
    return {key: value[index] for key, value in batch.items()} if isinstance(batch, dict) else batch[index]
