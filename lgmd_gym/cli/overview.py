"""The default of `bench`: what the package is about, on one screen."""

import shlex
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from lgmd_gym.benchmark.case import Row

OVERVIEW, SEEDS = "overview", 2
IDEAS = {
    "no-brake": "never brakes; its contacts are the threats.",
    "spike-threshold": "the paper's rule: brakes at 30 spikes/s of one neuron. In the laboratory only an "
    "approach reaches that; in worlds, where the car shakes and the roadside passes, driving does, too.",
    "stopping-zone": "the best rule: narrow camera fields, stabilised, that end where the car can stop.",
    "policy:all-round": "the best policy: a network on the neurons of such fields and of the sides.",
    "last-moment-oracle": "the bound: knows the future, and brakes at the last moment that avoids a contact.",
}
"""Agents of the default run, with one sentence on each."""


def print_overview(rows: "list[Row]", agents: list[str], console: Console, neuron: str | None = None) -> None:
    """Print the scores in the laboratory and in worlds, one sentence on each agent, and what to run next."""
    from lgmd_gym.benchmark.analysis.tables import place_table
    from lgmd_gym.benchmark.task import NO_BRAKE
    from lgmd_gym.report.conclusion import agent_note

    console.print(place_table(rows, agents))
    for agent in agents:
        console.print(f"{agent} – {IDEAS.get(agent) or agent_note(agent)}")
    chosen = [agent for agent in agents if agent != NO_BRAKE]
    words = ["lgmd-gym bench --suite r152 --seeds 20 --conditions mixed"]
    if any(agent not in IDEAS for agent in chosen):
        words.append(shlex.join(["--agents", *chosen]))
    if neuron is not None:
        words.append(shlex.join(["--neuron", neuron]))
    console.print(f"\nnext: {' '.join(words)}")
