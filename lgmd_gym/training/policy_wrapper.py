"""`PolicyView`: an environment as a policy sees it, scaled, with memory, at the policy's own pace."""

from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from lgmd_gym.agents.policies.features import FeatureConfig, FeatureHistory, source_observation


class PolicyView(gym.Wrapper, RecordConstructorArgs):
    """Shows a policy what `features` say, and holds each of its actions for `repeat` decisions.

    Observations become a `Dict` of float32 vectors in [-5, 5], oldest first, and frames uint8 with the
    history in their channels; rewards of the decisions held are summed and scaled. As a plain wrapper with
    keyword arguments it has the form of rl-zoo's `env_wrapper`.

    Args:
        env: An environment inside `LGMDObservation`, with `include_frame` if frames are wanted.
        **features: Fields of `lgmd_gym.agents.policies.features.FeatureConfig`.

    Raises:
        ValueError: For an unknown field or input, or one that the observation lacks.
    """

    def __init__(self, env: gym.Env, **features: Any) -> None:
        RecordConstructorArgs.__init__(self, **features)
        gym.Wrapper.__init__(self, env)
        self.features = FeatureConfig.from_dict(features)
        self._memory = FeatureHistory(self.features)
        given = env.observation_space
        if not isinstance(given, spaces.Dict):
            raise ValueError(f"PolicyView needs the Dict observation of LGMDObservation, got {given}")
        shapes = {name: space.shape or () for name, space in given.spaces.items()}
        for name in self.features.inputs:
            if source_observation(name) not in shapes:
                raise ValueError(
                    f"the policy input {name!r} is not observed; make it with include_{name}=True"
                )
        self.observation_space = spaces.Dict(
            {
                name: spaces.Box(low, high, shape, dtype)
                for name, (low, high, shape, dtype) in self.features.box_arguments(shapes).items()
            }
        )

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Reset the environment; the first observation fills the history."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._memory.reset()
        self._memory.update(observation)
        return self._memory.stack(), info

    def step(self, action: Any) -> tuple[dict[str, np.ndarray], float, bool, bool, dict[str, Any]]:
        """Hold an action for `repeat` decisions, or to the episode's end if it latches."""
        features, total, held = self.features, 0.0, 0
        latched = features.latches(self._demand(action))
        if latched:
            self.env.set_wrapper_attr(
                "rendering_paused", True
            )  # nothing depends on what is seen from here on
        while True:
            observation, reward, terminated, truncated, info = self.env.step(action)
            total, held = total + float(reward), held + 1
            if not latched:
                self._memory.update(observation)
            if terminated or truncated or (held >= features.repeat and not latched):
                break
        if latched:  # the end of what can be decided, whatever ended the episode
            terminated, truncated = True, False
        return self._memory.stack(), features.reward_scale * total, terminated, truncated, info

    def _demand(self, action: Any) -> float:
        """Return the longitudinal demand that an action stands for."""
        levels = getattr(getattr(self.env.unwrapped, "action_type", None), "levels", None)
        return float(np.reshape(action, -1)[0]) if levels is None else levels[int(action)]
