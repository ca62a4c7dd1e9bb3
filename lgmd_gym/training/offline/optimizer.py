"""`Optimizer`: gradient steps of one network."""

from typing import Any, NamedTuple

import torch


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
    """Return AdamW with a one-cycle schedule for a network's parameters, without those of its value function.

    Args:
        network: Network of a stable-baselines3 policy.
        learning_rate: Maximum of the schedule.
        weight_decay: See `torch.optim.AdamW`.
        steps: Number of steps of the schedule.
    """
    trained = [value for name, value in network.named_parameters() if "value" not in name]
    optimizer = torch.optim.AdamW(trained, learning_rate, weight_decay=weight_decay)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, learning_rate, total_steps=steps)
    return Optimizer(trained, optimizer, schedule)
