"""The vector engine: many braking environments in compiled code, for Gymnasium and stable-baselines3."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lgmd_gym.engine.sb3 import SB3VecEnv
    from lgmd_gym.engine.vector_env import BrakingVectorEnv

__all__ = ["BrakingVectorEnv", "SB3VecEnv"]

_MODULES = {"BrakingVectorEnv": "vector_env", "SB3VecEnv": "sb3"}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
