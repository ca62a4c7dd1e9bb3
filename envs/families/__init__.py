"""Scenario families: functions from SI arguments to a `Scenario`, and a random distribution over them."""

# Imported to register their families, in the order of the documentation.
from lgmd_gym.envs.families import (  # noqa: F401, I001
    rear,
    motorcycles,
    crossing,
    crossing_pedestrians,
    crossing_bicycles,
    along,
    turning_across,
    head_on,
    adjacent,
    obstacles,
    turning,
    manoeuvres,
    curves,
    boxes,
)
from lgmd_gym.envs.families.registry import FAMILIES, make_scenario

__all__ = ["FAMILIES", "make_scenario"]
