"""`PolicyBatch`: a learned policy in many environments."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.agents.batch import BatchAgent

if TYPE_CHECKING:
    from lgmd_gym.agents.policies.policy import Policy

# The outputs of a network depend on the size of the batch, because the order of float32 sums does. The
# differences are near 1e-6. A lead of the best action beyond this limit does not depend on them.
SAFE_LEAD = 1e-3


class PolicyBatch(BatchAgent):
    """`Policy` in N environments, with one pass of the network for all of them.

    The demands equal those of `Policy`: where the two best actions are almost equal, and for continuous
    actions, the network runs for each environment by itself.

    Args:
        policy: The policy.
        num_envs: Number of environments N.
    """

    def __init__(self, policy: "Policy", num_envs: int) -> None:
        super().__init__(num_envs)
        self._policy = policy
        self._histories = [policy.make_inputs() for _ in range(num_envs)]
        self._decisions = np.zeros(num_envs, np.int64)
        self._demands = np.zeros(num_envs)

    def reset(self, index: int, seed: int | None = None) -> None:
        """Clear the history and release the brake of environment `index`."""
        self._histories[index].reset()
        self._decisions[index] = 0
        self._demands[index] = 0.0

    def demands(
        self, observations: Mapping[str, np.ndarray], infos: Mapping[str, Any], active: np.ndarray
    ) -> np.ndarray:
        """Return new demands at every `repeat`-th call, else the last ones; hold latched demands."""
        features = self._policy.features
        inputs: dict[int, dict[str, np.ndarray]] = {}
        for index in np.flatnonzero(active).tolist():
            if features.latches(self._demands[index]):
                continue
            self._histories[index].update({key: values[index] for key, values in observations.items()})
            if self._decisions[index] % features.repeat == 0:
                inputs[index] = self._histories[index].stack()
            self._decisions[index] += 1
        if inputs:
            self._demands[list(inputs)] = self._decide(list(inputs.values()))
        self.alerts = self._demands < 0.0
        return self._demands

    def _decide(self, inputs: Sequence[dict[str, np.ndarray]]) -> list[float]:
        """Return the demands for the inputs of several environments."""
        policy, demands = self._policy, self._policy.card.demands
        if not demands or len(inputs) == 1:
            return [policy.decide(item) for item in inputs]
        values = action_values(
            policy.network, {key: np.stack([item[key] for item in inputs]) for key in inputs[0]}
        )
        if values is None or values.shape[1] < 2:
            return [policy.decide(item) for item in inputs]
        second, best = np.sort(values, axis=1)[:, -2:].T
        safe = best - second > SAFE_LEAD * np.maximum(1.0, np.abs(values).max(axis=1))
        actions = values.argmax(axis=1)
        return [
            demands[action] if certain else policy.decide(item)
            for item, action, certain in zip(inputs, actions.tolist(), safe.tolist(), strict=True)
        ]


def action_values(network: Any, inputs: dict[str, np.ndarray]) -> np.ndarray | None:
    """Return the values that a stable-baselines3 policy maximises over its discrete actions.

    Args:
        network: A policy with discrete actions.
        inputs: Batch of observations.

    Returns:
        Logits or Q values, shape (N, actions), or None if the policy has neither.
    """
    import torch

    with torch.no_grad():
        network.set_training_mode(False)
        tensors, _ = network.obs_to_tensor(inputs)
        if hasattr(network, "q_net"):
            return network.q_net(tensors).numpy()
        if hasattr(network, "get_distribution"):
            return network.get_distribution(tensors).distribution.logits.numpy()
    return None
