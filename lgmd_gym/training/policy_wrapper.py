"""`PolicyWrapper`: the inputs, history and decision rate of a policy as a Gymnasium wrapper."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from lgmd_gym.agents.policies.features import ZONE_INPUTS, FeatureConfig, FeatureHistory, source_observation

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
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Reset the environment and fill the history with the first observation."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._history.reset()
        self._update(observation)
        return self._stack(), info

    def step(self, action: Any) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
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

    def _update(self, observation: dict[str, Any]) -> None:
        self._history.update({name: np.asarray(values)[None] for name, values in observation.items()})

    def _stack(self) -> dict[str, np.ndarray]:
        return {name: values[0] for name, values in self._history.stack().items()}

    def _demand(self, action: Any) -> float:
        """Return the longitudinal demand of an action."""
        demands = getattr(getattr(self.env.unwrapped, "action_type", None), "demands", None)
        return float(np.reshape(action, -1)[0]) if demands is None else demands[int(action)]


def policy_space(observation_space: spaces.Space, features: FeatureConfig) -> spaces.Dict:
    """Return the space of a policy's inputs.

    Args:
        observation_space: Observation space of the environment.
        features: Inputs of the policy.

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
