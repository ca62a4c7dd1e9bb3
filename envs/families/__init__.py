"""Scenario families: functions from SI arguments to a `Scenario`, and a random distribution over them.

A family is declared in one place, see `family`: its function, the bounds and meanings of its arguments, and
how often and with which arguments random levels contain it.
"""

# Imported to register their families; the order is that of the documentation only.
from lgmd_gym.envs.families import (  # noqa: F401, I001
    rear,
    crossing,
    vulnerable,
    turning,
    adjacent,
    obstacles,
    curves,
)
from lgmd_gym.envs.families.family import FAMILIES, LEVELS, Level, family, make_scenario

__all__ = ["FAMILIES", "LEVELS", "Level", "family", "make_scenario"]
