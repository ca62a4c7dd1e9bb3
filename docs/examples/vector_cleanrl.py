"""PPO (Schulman et al. 2017) in a single file in CleanRL's style, with PyTorch and the engine only.

    python docs/examples/vector_cleanrl.py 200

A network with two hidden layers reads the outputs of one neuron and the ego speed, and chooses between no
braking and full braking ten times per second.
"""

import sys
import time
from dataclasses import dataclass

import gymnasium as gym
import numpy as np
import torch
from gymnasium.vector import VectorEnv
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from torch import Tensor, nn
from torch.distributions import Categorical

import lgmd_gym  # noqa: F401  (registers the environments)

CONFIG = {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}, "policy_frequency": 10}
SCALES = {"spike_frequency": 300.0, "membrane_potential": 1.0, "ffi": 100.0, "ego_speed": 30.0}


@dataclass(frozen=True)
class Args:
    """Options of the training."""

    seed: int = 0
    num_envs: int = 16
    steps: int = 64  # decisions of each environment per iteration
    epochs: int = 4
    minibatches: int = 4
    learning_rate: float = 1e-3
    gamma: float = 0.99
    gae_lambda: float = 0.95
    clip: float = 0.2
    entropy: float = 0.003
    value_weight: float = 0.5
    max_grad_norm: float = 0.5
    reward_scale: float = 0.1  # a contact costs up to 20


class Network(nn.Module):
    """Actor and critic."""

    def __init__(self, inputs: int, actions: int) -> None:
        super().__init__()
        self.actor, self.critic = mlp(inputs, actions), mlp(inputs, 1)
        with torch.no_grad():  # brake in about 5 % of the first decisions, because each one ends the approach
            self.actor[-1].weight.mul_(0.01)
            self.actor[-1].bias.copy_(torch.tensor([3.0, 0.0]))

    def forward(self, x: Tensor) -> tuple[Categorical, Tensor]:
        """Return the distribution of the actions and the values, for inputs of shape (N, inputs)."""
        return Categorical(logits=self.actor(x)), self.critic(x).squeeze(-1)


@dataclass
class Batch:
    """Decisions of an iteration; the first two axes are steps and environments."""

    inputs: Tensor
    actions: Tensor
    log_probs: Tensor
    rewards: Tensor
    values: Tensor
    dones: Tensor


def mlp(inputs: int, outputs: int) -> nn.Sequential:
    """Return a network with two hidden layers."""
    return nn.Sequential(
        nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, outputs)
    )


def make_envs(num_envs: int) -> VectorEnv:
    """Return the engine with episode statistics."""
    envs = gym.make_vec(
        "LGMD/RandomBraking-v0", num_envs=num_envs, threads=2, config=CONFIG, autoreset_mode="SameStep"
    )
    return RecordEpisodeStatistics(envs)


def features(observations: dict[str, np.ndarray]) -> Tensor:
    """Return the inputs of the network, float32, shape (N, 4)."""
    return torch.from_numpy(np.concatenate([observations[k] / s for k, s in SCALES.items()], axis=1)).float()


@torch.no_grad()
def collect(envs: VectorEnv, network: Network, inputs: Tensor, args: Args) -> tuple[Batch, Tensor]:
    """Return the decisions of one iteration and the next inputs."""
    rows = []
    for _ in range(args.steps):
        distribution, values = network(inputs)
        actions = distribution.sample()
        observations, rewards, terminated, truncated, infos = envs.step(actions.numpy())
        rewards = args.reward_scale * torch.from_numpy(rewards).float()
        if truncated.any():  # the return of a truncated episode includes the value of its last state
            cut = np.flatnonzero(truncated)
            last = {k: np.stack([infos["final_obs"][i][k] for i in cut]) for k in SCALES}
            rewards[cut] += args.gamma * network(features(last))[1]
        dones = torch.from_numpy(terminated | truncated).float()
        rows.append((inputs, actions, distribution.log_prob(actions), rewards, values, dones))
        inputs = features(observations)
    return Batch(*map(torch.stack, zip(*rows, strict=True))), inputs


def advantages(batch: Batch, last_values: Tensor, args: Args) -> Tensor:
    """Return the generalised advantage estimates (Schulman et al. 2016), shape (steps, N)."""
    result, following, values = torch.zeros_like(batch.rewards), torch.zeros_like(last_values), last_values
    for step in reversed(range(len(batch.rewards))):
        going_on = 1.0 - batch.dones[step]
        error = batch.rewards[step] + args.gamma * going_on * values - batch.values[step]
        following = error + args.gamma * args.gae_lambda * going_on * following
        result[step], values = following, batch.values[step]
    return result


def update(
    network: Network, optimizer: torch.optim.Optimizer, batch: Batch, gains: Tensor, args: Args
) -> None:
    """Make the gradient steps of one iteration with the clipped loss."""
    returns = (gains + batch.values).flatten()
    inputs, gains = batch.inputs.flatten(0, 1), gains.flatten()
    actions, log_probs = batch.actions.flatten(), batch.log_probs.flatten()
    for _ in range(args.epochs):
        for part in torch.randperm(len(gains)).chunk(args.minibatches):
            distribution, values = network(inputs[part])
            ratio = (distribution.log_prob(actions[part]) - log_probs[part]).exp()
            gain = (gains[part] - gains[part].mean()) / (gains[part].std() + 1e-8)
            clipped = ratio.clamp(1.0 - args.clip, 1.0 + args.clip)
            policy_loss = -torch.min(gain * ratio, gain * clipped).mean()
            value_loss = (values - returns[part]).square().mean()
            loss = policy_loss + args.value_weight * value_loss
            loss = loss - args.entropy * distribution.entropy().mean()
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), args.max_grad_norm)
            optimizer.step()


def main(iterations: int = 200, args: Args = Args(num_envs=64)) -> list[float]:
    """Train; return the mean return of the last 100 episodes after each iteration."""
    torch.manual_seed(args.seed)
    envs = make_envs(args.num_envs)
    network = Network(len(SCALES), int(envs.single_action_space.n))
    optimizer = torch.optim.Adam(network.parameters(), args.learning_rate, eps=1e-5)
    inputs, start, returns = features(envs.reset(seed=args.seed)[0]), time.perf_counter(), []
    for iteration in range(1, iterations + 1):
        batch, inputs = collect(envs, network, inputs, args)
        with torch.no_grad():
            last_values = network(inputs)[1]
        update(network, optimizer, batch, advantages(batch, last_values, args), args)
        if envs.return_queue:
            returns.append(float(np.mean(envs.return_queue)))
            count = iteration * args.steps * args.num_envs
            rate = count / (time.perf_counter() - start)
            print(f"step {count}: mean return {returns[-1]:.2f}, {rate:.0f} decisions/s")
    envs.close()
    return returns


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
