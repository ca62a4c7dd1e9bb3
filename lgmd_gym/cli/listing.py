"""What there is to name, as tables."""

import inspect
from collections.abc import Callable

from rich.console import Console
from rich.table import Table


def show(what: str, console: Console) -> None:
    """Print one list, or all of them."""
    for name, draw in LISTS.items():
        if what in ("all", name):
            console.print(draw())


def suites() -> Table:
    """Return the suites with their numbers of cases per family."""
    from lgmd_gym.benchmark.suites import SUITES
    from lgmd_gym.benchmark.traffic.rows import SUITE as TRAFFIC
    from lgmd_gym.envs.traffic.registration import KINDS

    table = Table("suite", "cases", "families", "what it is", title="suites")
    for name, suite in SUITES.items():
        counts: dict[str, int] = {}
        for case in suite.cases:
            kind = case.family + (" with a warned driver" if case.fcw_driver else "")
            counts[kind] = counts.get(kind, 0) + 1
        families = ", ".join(f"{family} {count}" for family, count in counts.items())
        table.add_row(name, str(len(suite.cases)), families, suite.about)
    about = "an IDM driver among highway-env's cars, the agent may only brake; false brakes per 100 km"
    table.add_row(TRAFFIC, "any", ", ".join(KINDS), about)
    return table


def agents() -> Table:
    """Return the agents with their options and what they do."""
    from lgmd_gym.agents import AGENTS
    from lgmd_gym.agents.policies.policy import find_policy, read_card, shipped

    table = Table("agent", "options", "what it does", title="agents")
    for name, cls in AGENTS.items():
        options = ", ".join(f"{option}={default:g}" for option, default in cls.options().items())
        table.add_row(name, options, _first_line(cls))
    for name in shipped():
        algo = read_card(find_policy(name))["algo"].upper()
        about = f'Learned with {algo}; needs the extra "train". Loading it runs what its author pickled.'
        table.add_row(f"policy:{name}", "", about)
    return table


def envs() -> Table:
    """Return the environments with their arguments."""
    from lgmd_gym.envs import FAMILIES, env_id
    from lgmd_gym.envs.registration import RANDOM

    table = Table("environment", "arguments (SI)", "what happens", title="environments")
    for family, function in FAMILIES.items():
        names = ", ".join(inspect.signature(function).parameters)
        table.add_row(env_id(family), names, _first_line(function))
    table.add_row(
        env_id(RANDOM), "split, start_level, num_levels, conditions", "A new one of these at every reset."
    )
    return table


def cameras() -> Table:
    """Return the camera presets."""
    from lgmd_gym.camera.params import PRESETS

    table = Table("camera", "frame", "field of view", "px per degree", title="cameras")
    for name, params in PRESETS.items():
        height, width = params.shape
        table.add_row(name, f"{width}×{height}", f"{params.hfov_deg:g}°", f"{params.pixels_per_degree:.1f}")
    table.add_row("birdseye", "highway-env's own view from above", "", "")
    return table


def _first_line(item: object) -> str:
    return (inspect.getdoc(item) or "").splitlines()[0]


LISTS: dict[str, Callable[[], Table]] = {"suites": suites, "agents": agents, "envs": envs, "cameras": cameras}
