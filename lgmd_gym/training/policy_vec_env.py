"""`PolicyVecEnv`: `PolicyWrapper` for many environments of the engine, as a `VecEnv`."""

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from lgmd_gym.agents.policies.features import FeatureConfig, FeatureHistory
from lgmd_gym.engine import BrakingVectorEnv
from lgmd_gym.engine.sb3 import EngineVecEnv
from lgmd_gym.training.policy_wrapper import policy_space


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

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
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
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
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
        simulation = self.envs.simulation
        simulation.step(demands, running, rendering)
        self._rewards[running] += simulation.outcome.rewards[running]

    def _ended(self) -> np.ndarray:
        return self.envs.simulation.outcome.terminated | self.envs.simulation.outcome.truncated

    def _end_episodes(
        self,
        done: np.ndarray,
        truncated: np.ndarray,
        observations: dict[str, np.ndarray],
        infos: list[dict[str, Any]],
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
