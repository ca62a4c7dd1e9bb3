# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Networks of `TimeToBrakeLearner`: models of stable-baselines3, their optimizers, and merged ensembles.

Adam's steps are equally long for all weights, so that it learns faster from features of equal spread; the
levels of columns have standard deviations of 0.08 to 0.65. After training the mean and the scale become part
of the first layer: the saved policy reads the features as they are.
"""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import torch

from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import shown

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.type_aliases import GymEnv


def make_model(policy: str, env: "GymEnv", seed: int, policy_kwargs: Arguments) -> "PPO":
    """Return a PPO model; only its network and its file format are used."""
    from stable_baselines3 import PPO

    torch.set_num_threads(1)
    return PPO(policy, env, 2e-3, 2, 2, seed=seed, device="cpu", policy_kwargs=policy_kwargs)


def network_arguments(changes: Arguments) -> Arguments:
    """Return the arguments of a network: the defaults of `TimeToBrakeLearner` with some changes."""
    return {"activation_fn": torch.nn.ReLU, "net_arch": {"pi": [64, 64], "vf": []}} | changes


class Optimizer(NamedTuple):
    """Trained parameters of a network, their optimizer and the schedule of its learning rate."""

    trained: list[torch.nn.Parameter]
    optimizer: torch.optim.Optimizer
    schedule: torch.optim.lr_scheduler.LRScheduler

    def step(self, loss: torch.Tensor) -> None:
        """Take one step down the gradient of a loss."""
        self.optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(self.trained, 1.0)
        self.optimizer.step()
        self.schedule.step()


def make_optimizer(network: Any, learning_rate: float, weight_decay: float, steps: int) -> Optimizer:
    """Return AdamW with a one-cycle schedule for the parameters of a network without its value function."""
    trained = [value for name, value in network.named_parameters() if "value" not in name]
    optimizer = torch.optim.AdamW(trained, learning_rate, weight_decay=weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, learning_rate, total_steps=steps)
    return Optimizer(trained, optimizer, schedule)


def merged_layers(policy_kwargs: Arguments, count: int) -> Arguments:
    """Return the arguments of a network that is as wide as `count` networks together.

    Raises:
        ValueError: If `net_arch` does not contain the layers of the policy.
    """
    layers = policy_kwargs["net_arch"]
    if isinstance(layers, dict) and "pi" not in layers:
        raise ValueError(f"net_arch of an ensemble must contain 'pi', got {shown(layers)}; use pi: [64, 64]")
    units = layers["pi"] if isinstance(layers, dict) else layers
    return policy_kwargs | {"net_arch": {"pi": [count * size for size in units], "vf": []}}


@torch.no_grad()
def merge_networks(networks: Sequence[Any], merged: Any) -> None:
    """Write networks into one with the arguments of `merged_layers`.

    Each layer contains the layers of the networks side by side: hidden layers are block diagonal, and the
    outputs are the means of those of the networks.
    """
    layers = [linear_layers(network) for network in networks]
    targets = linear_layers(merged)
    for depth, (target, *parts) in enumerate(zip(targets, *layers, strict=True)):
        weights, biases = [part.weight for part in parts], [part.bias for part in parts]
        if depth == len(targets) - 1:
            joined = torch.cat(weights, 1) if depth else torch.stack(weights).sum(0)
            target.weight.copy_(joined / len(parts))
            target.bias.copy_(torch.stack(biases).mean(0))
        else:
            target.weight.copy_(torch.block_diag(*weights) if depth else torch.cat(weights))
            target.bias.copy_(torch.cat(biases))


def linear_layers(network: Any) -> list[torch.nn.Linear]:
    """Return the layers from the inputs to the outputs of the actions."""
    hidden = [item for item in network.mlp_extractor.policy_net if isinstance(item, torch.nn.Linear)]
    return [*hidden, network.action_net]


def check_layers(start: Any, network: Any) -> None:
    """Raise ValueError if the layers of a network differ from those of its start."""
    given, own = ([tuple(layer.weight.shape) for layer in linear_layers(item)] for item in (start, network))
    if given != own:
        raise ValueError(
            f"the layers of start, outputs and inputs, are {given}, those of the training {own}; "
            "use its net_arch"
        )
    kinds = [[type(part).__name__ for part in item.mlp_extractor.policy_net] for item in (start, network)]
    if kinds[0] != kinds[1]:
        raise ValueError(
            f"the activations of start are {kinds[0][1]}, those of the training {kinds[1][1]}; "
            "use its activation_fn"
        )


@torch.no_grad()
def blend_layers(start: Any, network: Any, share: float) -> None:
    """Replace a share of the weights of a network by those of another one of the same size."""
    for other, layer in zip(linear_layers(start), linear_layers(network), strict=True):
        for name, weights in layer.named_parameters():
            weights.mul_(1.0 - share).add_(share * getattr(other, name))


MIN_VARIANCE = 1e-3  # added, so that features that hardly vary are not magnified


class Standardisation(NamedTuple):
    """Mean and scale of each feature."""

    mean: torch.Tensor  # mean, (features,)
    scale: torch.Tensor  # one over the standard deviation, (features,)

    def apply(self, features: torch.Tensor) -> torch.Tensor:
        """Standardise features, (M, features), in place and return them."""
        return features.sub_(self.mean).mul_(self.scale)  # new arrays of 30 MB would cost as much as products

    @torch.no_grad()
    def fold(self, layer: torch.nn.Linear) -> None:
        """Change a first layer of standardised features into that of the features as they are."""
        layer.weight.mul_(self.scale)
        layer.bias.sub_(layer.weight @ self.mean)

    @torch.no_grad()
    def unfold(self, layer: torch.nn.Linear) -> None:
        """Change a first layer of features as they are into that of standardised features."""
        layer.bias.add_(layer.weight @ self.mean)
        layer.weight.div_(self.scale)


@torch.no_grad()
def measure(batches: Iterable[torch.Tensor]) -> Standardisation:
    """Return the standardisation of features, (M, features) per batch, at least one row."""
    count, total, squares = 0, 0.0, 0.0
    for batch in batches:
        values = batch.double()
        count, total, squares = count + len(values), total + values.sum(0), squares + values.square().sum(0)
    mean: Any = total / count
    variance: Any = squares / count - mean.square()
    scale = 1.0 / (variance.clamp(min=0.0) + MIN_VARIANCE).sqrt()
    return Standardisation(mean.float(), scale.float())
