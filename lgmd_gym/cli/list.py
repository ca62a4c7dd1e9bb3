"""The `list` command: suites, agents, environments and cameras as tables."""

import inspect
from collections.abc import Callable

from rich.table import Table

from lgmd_gym.agents import AGENTS
from lgmd_gym.agents.policies.policy import find_policy, read_card, shipped_policies
from lgmd_gym.benchmark.suites import SUITES, TRAFFIC
from lgmd_gym.camera.params import PRESETS
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import List
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.registration import RANDOM, SCENARIO, SCENARIO_ARGUMENT
from lgmd_gym.envs.traffic.registration import KINDS


def run(options: List) -> int:
    """Print one table, or all of them."""
    console = make_console()
    for name, table in TABLES.items():
        if options.what in ("all", name):
            console.print(table())
    return 0


def suites() -> Table:
    """Return the suites with their number of cases per family."""
    table = Table("suite", "cases", "families", "description", title="suites")
    for name, suite in SUITES.items():
        counts: dict[str, int] = {}
        for case in suite.cases:
            kind = case.family + (" with FCW driver" if case.fcw_driver else "")
            counts[kind] = counts.get(kind, 0) + 1
        families = ", ".join(f"{family} {count}" for family, count in counts.items())
        table.add_row(name, str(len(suite.cases)), families, suite.about)
    description = "IDM traffic on highway-env's roads; the agent can only brake; false activations per 100 km"
    table.add_row(TRAFFIC, "one per seed", ", ".join(KINDS), description)
    return table


def agents() -> Table:
    """Return the agents with their options."""
    table = Table("agent", "options", "description", title="agents")
    for name, cls in AGENTS.items():
        options = ", ".join(f"{option}={default:g}" for option, default in cls.options().items())
        table.add_row(name, options, _summary(cls))
    for name in shipped_policies():
        algo = read_card(find_policy(name))["algo"].upper()
        description = f'Policy trained with {algo}; requires the extra "train". Loading it unpickles code.'
        table.add_row(f"policy:{name}", "", description)
    return table


def envs() -> Table:
    """Return the environments with their arguments."""
    table = Table("environment", "arguments (SI)", "description", title="environments")
    for family, function in FAMILIES.items():
        table.add_row(env_id(family), ", ".join(inspect.signature(function).parameters), _summary(function))
    table.add_row(env_id(SCENARIO), SCENARIO_ARGUMENT, "A scenario given as data, as in `Scenario`.")
    arguments = "split, start_level, num_levels, conditions"
    table.add_row(env_id(RANDOM), arguments, "Draw a new scenario of these families at every reset.")
    return table


def cameras() -> Table:
    """Return the camera presets."""
    table = Table("camera", "frame", "field of view", "px per degree", title="cameras")
    for name, params in PRESETS.items():
        height, width = params.shape
        table.add_row(name, f"{width}×{height}", f"{params.hfov_deg:g}°", f"{params.pixels_per_degree:.1f}")
    table.add_row("birdseye", "highway-env's top view", "", "")
    return table


def _summary(item: object) -> str:
    """Return the first line of a docstring."""
    return (inspect.getdoc(item) or "").splitlines()[0]


TABLES: dict[str, Callable[[], Table]] = {
    "suites": suites,
    "agents": agents,
    "envs": envs,
    "cameras": cameras,
}
