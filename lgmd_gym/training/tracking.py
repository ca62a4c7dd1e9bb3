"""Weights & Biases: the configuration of a training run, and what it writes for TensorBoard."""

from contextlib import AbstractContextManager, nullcontext
from importlib import import_module
from pathlib import Path
from typing import Any

from lgmd_gym.training.config import TrainConfig


def wandb_module() -> Any:
    """Return the package wandb.

    Raises:
        ValueError: If it is not installed.
    """
    try:
        return import_module("wandb")
    except ImportError:
        raise ValueError("the option wandb requires the package wandb: pip install wandb") from None


def wandb_run(config: TrainConfig, folder: Path) -> AbstractContextManager[Any]:
    """Return the run of a training in W&B, with files in its folder; nothing without the option `wandb`."""
    if config.wandb is None:
        return nullcontext()
    return wandb_module().init(
        project=config.wandb,
        name=folder.name,
        dir=str(folder),
        config=config.to_dict(),
        sync_tensorboard=True,
    )
