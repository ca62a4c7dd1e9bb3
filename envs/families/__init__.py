"""Scenario families: functions from SI arguments to a `Scenario`, and a random distribution over them.

A family is declared in one place, see `family`: its function, the bounds and meanings of its arguments, and
how often and with which arguments random levels contain it.
"""

from importlib import import_module

from lgmd_gym.envs.families.family import FAMILIES, LEVELS, Level, family, make_scenario

__all__ = ["FAMILIES", "LEVELS", "Level", "family", "make_scenario"]

# Each module registers its families, in the order of the documentation; that of levels is in `distribution`.
for _module in ("rear", "crossing", "vulnerable", "turning", "adjacent", "obstacles", "curves", "sequences"):
    import_module(f"{__name__}.{_module}")
