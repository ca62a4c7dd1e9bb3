"""Scenario families: functions from SI arguments to a `Scenario`, and a random distribution over them."""

# Imported to register their families, in the order of the documentation.
from lgmd_gym.envs.scenarios import rear, crossing, adjacent, obstacles, turning  # noqa: F401, I001
from lgmd_gym.envs.scenarios.registry import FAMILIES, make_scenario

__all__ = ["FAMILIES", "make_scenario"]
