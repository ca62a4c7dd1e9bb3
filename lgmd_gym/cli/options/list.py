"""Options of `list`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from typing import Literal

from tyro.conf import Positional

from lgmd_gym.cli.options.values import Names


@dataclass(frozen=True, kw_only=True)
class List:
    """List suites, agents, environments, cameras or cases.

    A list that is longer than the terminal opens in a pager ($PAGER, else less).
    """

    what: Positional[Literal["all", "suites", "agents", "envs", "cameras", "cases"]] = "all"
    """Table to print; all has no cases."""
    module: Names = None
    """Modules with scenario families of your own to list: my_scenarios, or my_scenarios:MyFamily."""
    pager: bool = True
    """Use a pager in a terminal."""
