"""The `list` command: suites, agents, environments, cameras and cases as tables."""

import inspect
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from rich.table import Table
from tyro.conf import Positional

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import Names


@dataclass(frozen=True, kw_only=True)
class List:
    """List suites, agents, environments, cameras or cases.

    --pager shows a list that is longer than the terminal in a pager ($PAGER, else less).
    """

    what: Positional[Literal["all", "suites", "agents", "envs", "cameras", "cases"]] = "all"
    """Table to print; all has no cases."""
    module: Names = None
    """Modules with scenario families of your own to list: my_scenarios, or my_scenarios:MyFamily."""
    pager: bool = False
    """Use a pager in a terminal."""


def run(options: List) -> int:
    """Print one table, or all of them."""
    from lgmd_gym.envs import import_families

    import_families(options.module or ())
    console = make_console()
    with console.capture() as capture:
        for name, table in TABLES.items():
            if options.what == name or (options.what == "all" and name != "cases"):
                console.print(table())
    text = capture.get()
    if options.pager and console.is_terminal and text.count("\n") >= console.height:
        import pydoc

        os.environ.setdefault("LESS", "FRX")  # show colours, and leave the text on the screen
        pydoc.pager(text)
    else:
        sys.stdout.write(text)
    return 0


def suites() -> Table:
    """Return the suites with their number of cases per family."""
    from lgmd_gym.benchmark.case import TRAFFIC_SUITES
    from lgmd_gym.benchmark.suites import SUITES
    from lgmd_gym.envs.registration import TRAFFIC_KINDS

    table = Table("suite", "cases", "description", title="suites")
    for name, suite in SUITES.items():
        counts: dict[str, int] = {}
        for case in suite.cases:
            kind = case.family + (" with FCW driver" if case.fcw_driver else "")
            counts[kind] = counts.get(kind, 0) + 1
        families = ", ".join(f"{family} {count}" for family, count in counts.items())
        table.add_row(name, str(len(suite.cases)), _entry(suite.about, "families", families))
    about = "IDM traffic on highway-env's roads, {} drivers; the agent can only brake; activations per 100 km"
    for name, attention in TRAFFIC_SUITES.items():
        kinds = ", ".join(TRAFFIC_KINDS)
        table.add_row(name, "one per\nseed", _entry(about.format(attention), "kinds", kinds))
    return table


def agents() -> Table:
    """Return the agents with their options."""
    from lgmd_gym.agents import AGENTS
    from lgmd_gym.agents.policies.card import read_card
    from lgmd_gym.agents.policies.policy import find_policy, shipped_policies

    table = Table("agent", "description", title="agents")
    for name, cls in AGENTS.items():
        options = ", ".join(f"{option}={default:g}" for option, default in cls.options().items())
        table.add_row(name, _entry(_summary(cls), "options", options))
    for name in shipped_policies():
        card = read_card(find_policy(name))
        inputs = ", ".join(card["features"]["inputs"])
        description = f"Learned policy with the inputs {inputs}."
        options = "margin=0" if card.get("brake") or len(card["demands"] or ()) == 2 else ""
        table.add_row(f"policy:{name}", _entry(description, "options", options))
    return table


def envs() -> Table:
    """Return the environments with their arguments."""
    from lgmd_gym.envs import FAMILIES, env_id
    from lgmd_gym.envs.registration import LEVEL_ARGUMENTS, RANDOM_TASKS, SCENARIO, SCENARIO_ARGUMENT

    table = Table("environment", "description", title="environments (arguments in SI units)")
    for family, function in FAMILIES.items():
        arguments = ", ".join(inspect.signature(function).parameters)
        table.add_row(env_id(family), _entry(_summary(function), "arguments", arguments))
    about = "A scenario given as data, as in `Scenario`."
    table.add_row(env_id(SCENARIO), _entry(about, "argument", SCENARIO_ARGUMENT))
    for name, task in RANDOM_TASKS.items():
        table.add_row(env_id(name), _entry(task.summary, "arguments", ", ".join(LEVEL_ARGUMENTS)))
    return table


def cameras() -> Table:
    """Return the camera presets."""
    from lgmd_gym.camera import PRESETS

    table = Table("camera", "frame", "field of view", "px per degree", title="cameras")
    for name, params in PRESETS.items():
        height, width = params.shape
        table.add_row(name, f"{width}×{height}", f"{params.hfov_deg:g}°", f"{params.pixels_per_degree:.1f}")
    table.add_row("birdseye", "highway-env's top view", "", "")
    return table


def cases() -> Table:
    """Return the cases of all suites with their arguments."""
    from lgmd_gym.benchmark.suites import SUITES

    table = Table("case", "arguments (SI units)", title="cases")
    for suite in SUITES.values():
        for case in suite.cases:
            arguments = (f"{name}={_value(value)}" for name, value in case.arguments)
            table.add_row(case.name, ", ".join(arguments))
    return table


def _value(value: object) -> str:
    """Return a number with four digits; of other values, the name or the type."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value) if isinstance(value, str | int) else f"<{type(value).__name__}>"


def _entry(description: str, kind: str, details: str) -> str:
    """Return a description with the details of a kind below it, if there are any."""
    return f"{description}\n{kind}: {details}" if details else description


def _summary(item: object) -> str:
    """Return the first line of a docstring."""
    return (inspect.getdoc(item) or "").splitlines()[0]


TABLES: dict[str, Callable[[], Table]] = {
    "suites": suites,
    "agents": agents,
    "envs": envs,
    "cameras": cameras,
    "cases": cases,
}
