# pyright: standard
# Not strict: Gymnasium and stable-baselines3 state few types.
"""The inputs, history and decision rate of a policy: for one environment, and for those of the engine."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from gymnasium.vector import AutoresetMode
from numpy.typing import ArrayLike

from lgmd_gym.agents.policies.features import ZONE_INPUTS, FeatureConfig, FeatureHistory, source_observation
from lgmd_gym.aliases import Arguments, Info, Values
from lgmd_gym.engine import BrakingVectorEnv
from lgmd_gym.engine.sb3 import EngineVecEnv

REMEDIES = {
    "frame": "make the environment with include_frame=True",
    "known_deceleration": "use cameras with brake_known, for example --sensors-of all-round",
}
"""How to add an observation that environments do not have by default."""


class PolicyWrapper(gym.Wrapper, RecordConstructorArgs):
    """Turns observations into policy inputs and repeats each action for `repeat` environment steps.

    The observation is a `Dict` of float32 vectors in [-5, 5], oldest values first, and of uint8 frames with
    the history in their channels. The rewards of the repeated steps are summed and scaled. With `latch`, the
    first hard braking is repeated until the episode ends, and the step terminates. The wrapper can be named
    in rl-zoo's `env_wrapper`.

    Args:
        env: Environment with `LGMDObservation`; `include_frame` is required for the input `frame`.
        **features: Fields of `lgmd_gym.agents.policies.features.FeatureConfig`.

    Raises:
        ValueError: For an unknown field or input, or an input that is not in the observation.
    """

    def __init__(self, env: gym.Env, **features: Any) -> None:
        RecordConstructorArgs.__init__(self, **features)
        gym.Wrapper.__init__(self, env)
        self.features = FeatureConfig.make(features)
        self._history = FeatureHistory(self.features)
        self.observation_space = policy_space(env.observation_space, self.features)

    def reset(
        self, *, seed: int | None = None, options: Arguments | None = None
    ) -> tuple[dict[str, np.ndarray], Info]:
        """Reset the environment and fill the history with the first observation."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._history.reset()
        self._update(observation)
        return self._stack(), info

    def step(self, action: ArrayLike) -> tuple[dict[str, np.ndarray], float, bool, bool, Info]:
        """Repeat an action for `repeat` steps, or until the episode ends if it latches."""
        reward_sum, steps = 0.0, 0
        latched = self.features.latches(self._demand(action))
        if latched:  # no later observation is used
            self.env.set_wrapper_attr("rendering_paused", True)
        while True:
            observation, reward, terminated, truncated, info = self.env.step(action)
            reward_sum, steps = reward_sum + float(reward), steps + 1
            if not latched:
                self._update(observation)
            if terminated or truncated or (steps >= self.features.repeat and not latched):
                break
        if latched:  # the policy decides nothing after this, so a truncation counts as a termination
            terminated, truncated = True, False
        return self._stack(), self.features.reward_scale * reward_sum, terminated, truncated, info

    def _update(self, observation: Values) -> None:
        self._history.update({name: np.asarray(values)[None] for name, values in observation.items()})

    def _stack(self) -> dict[str, np.ndarray]:
        return {name: values[0] for name, values in self._history.stack().items()}

    def _demand(self, action: Any) -> float:
        """Return the longitudinal demand of an action."""
        demands = getattr(getattr(self.env.unwrapped, "action_type", None), "demands", None)
        return float(np.reshape(action, -1)[0]) if demands is None else demands[int(action)]


def policy_space(observation_space: spaces.Space, features: FeatureConfig) -> spaces.Dict:
    """Return the space of a policy's inputs.

    Raises:
        ValueError: If an input is not in the observation.
    """
    if not isinstance(observation_space, spaces.Dict):
        raise ValueError(
            f"PolicyWrapper requires the Dict observation of LGMDObservation, got {observation_space}"
        )
    shapes = {name: space.shape or () for name, space in observation_space.spaces.items()}
    for name in features.inputs:
        if source_observation(name) not in shapes and name not in ZONE_INPUTS:
            remedy = REMEDIES.get(name, "wrap the environment in LGMDObservation")
            raise ValueError(f"policy input {name!r} is not in the observation; {remedy}")
    boxes = features.box_arguments(shapes).items()
    return spaces.Dict(
        {name: spaces.Box(low, high, shape, dtype) for name, (low, high, shape, dtype) in boxes}
    )


class PolicyVecEnv(EngineVecEnv):
    """N environments of the engine with the inputs, history and decision rate of a policy.

    Observations, rewards and ends equal those of a `DummyVecEnv` of `PolicyWrapper`s for the same seeds and
    actions. With `latch`, an environment that brakes hard runs to the end of its episode within the step,
    without cameras. Infos are empty until the end of an episode; then they are those of its last decision,
    with ``terminal_observation``, ``TimeLimit.truncated`` and ``episode`` as in `SB3VecEnv`.

    Args:
        envs: The engine in autoreset mode "Disabled".
        features: Inputs and timing of the policy.

    Raises:
        ValueError: If the engine has another autoreset mode, or an input is not in its observation.
    """

    envs: BrakingVectorEnv

    def __init__(self, envs: BrakingVectorEnv, features: FeatureConfig) -> None:
        mode = envs.metadata["autoreset_mode"]
        if mode != AutoresetMode.DISABLED:
            raise ValueError(f"envs must have autoreset_mode 'Disabled', got {mode.value!r}")
        super().__init__(envs, policy_space(envs.single_observation_space, features))
        self.features = features
        self._history = FeatureHistory(features, envs.num_envs)
        self._rewards = np.zeros(envs.num_envs)

    def reset(self) -> dict[str, np.ndarray]:
        """Reset all environments with the seeds of `seed`, if any; return their first observations.

        Raises:
            ValueError: If options were set; the environments have none.
        """
        return self._restart(np.ones(self.num_envs, np.bool_), self._take_seeds())

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[Info]]:
        """Advance each environment by one decision; return observations, rewards, ends and infos."""
        demands = self.envs.read_demands(self._actions)
        latched = self.features.latches(demands)
        self._rewards[:] = 0.0
        self._hold(demands, ~latched)
        self._brake(demands, latched)
        outcome = self.envs.simulation.outcome
        done, terminated = outcome.terminated | outcome.truncated, outcome.terminated | latched
        rewards = (self.features.reward_scale * self._rewards).astype(np.float32)
        self._count(rewards)
        observations = self._history.stack()
        infos: list[Info] = [{} for _ in range(self.num_envs)]
        if done.any():
            # The policy decides nothing after it latches its brake, so a truncation is a termination.
            self._end_episodes(done, outcome.truncated & ~terminated, observations, infos)
        return observations, rewards, done, infos

    def _hold(self, demands: np.ndarray, active: np.ndarray) -> None:
        """Repeat the demands of some environments for one decision of the policy."""
        running = active.copy()
        for _ in range(self.features.repeat):
            self._step(demands, running, rendering=True)
            self._history.update(self.envs.read_observations(), np.flatnonzero(running))
            running &= ~self._ended()

    def _brake(self, demands: np.ndarray, latched: np.ndarray) -> None:
        """Repeat the demands of some environments to the end of their episodes."""
        running = latched.copy()
        while running.any():
            self._step(demands, running, rendering=False)
            running &= ~self._ended()

    def _step(self, demands: np.ndarray, running: np.ndarray, rendering: bool) -> None:
        self.envs.advance(demands, running, rendering)
        self._rewards[running] += self.envs.simulation.outcome.rewards[running]

    def _ended(self) -> np.ndarray:
        return self.envs.simulation.outcome.terminated | self.envs.simulation.outcome.truncated

    def _end_episodes(
        self,
        done: np.ndarray,
        truncated: np.ndarray,
        observations: dict[str, np.ndarray],
        infos: list[Info],
    ) -> None:
        """Fill in the infos of ended episodes, restart them and replace their observations."""
        finals = self.envs.read_infos(done)
        names = [name for name in finals if f"_{name}" in finals]
        ended = np.flatnonzero(done).tolist()
        for index in ended:
            infos[index] = {name: finals[name][index] for name in names}
            infos[index]["terminal_observation"] = _row(observations, index)
            infos[index]["TimeLimit.truncated"] = bool(truncated[index])
            infos[index]["episode"] = self._statistics(index)
        for name, values in self._restart(done, None).items():
            observations[name][ended] = values

    def _restart(self, selected: np.ndarray, seeds: Any) -> dict[str, np.ndarray]:
        """Start new episodes in the selected environments; return their inputs."""
        observations, _ = self.envs.reset(seed=seeds, options={"reset_mask": selected})
        rows = np.flatnonzero(selected)
        self._history.reset(selected)
        self._history.update(observations, rows)
        return self._history.stack(rows)


def _row(observations: dict[str, np.ndarray], index: int) -> dict[str, np.ndarray]:
    return {name: values[index].copy() for name, values in observations.items()}
