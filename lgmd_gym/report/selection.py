"""Selection of the episodes that a report illustrates, by fixed rules."""

from collections.abc import Callable

from lgmd_gym.benchmark.analysis.protocol_limits import relative_impact
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import case_order
from lgmd_gym.benchmark.task import NO_BRAKE

MAX_FALSE_ACTIVATIONS = 12
AGENTS_WITHOUT_NEURON = (NO_BRAKE, "always-brake", "random-brake", "ttc-oracle")

# Description -> filter of the rows, and the value that the shown row maximises (the first one on ties).
EXTREMES: dict[str, tuple[Callable[[Row], bool], Callable[[Row], float]]] = {
    "smallest stopping margin": (
        lambda row: row["avoided"] and row["stopping_margin"] is not None,
        lambda row: -row["stopping_margin"],
    ),
    "fastest avoided threat": (lambda row: row["avoided"], lambda row: row["ego_speed"]),
    "hardest contact": (lambda row: row["collision"], relative_impact),
    "premature braking": (lambda row: row["premature_brake"], lambda row: 0.0),
    "hardest false activation": (lambda row: row["false_activation"], lambda row: row["peak_deceleration"]),
    "fastest non-threat without false activation": (
        lambda row: not row["threat"] and not row["false_activation"],
        lambda row: row["ego_speed"],
    ),
}


def neuron_agents(agents: list[str]) -> list[str]:
    """Return the agents that depend on the neuron or the camera."""
    return [agent for agent in agents if agent.split(":")[0] not in AGENTS_WITHOUT_NEURON]


def illustrated_agent(agents: list[str]) -> str:
    """Return the first agent that depends on the neuron; without one, the first that can brake."""
    braking = [agent for agent in agents if agent != NO_BRAKE]
    return [*neuron_agents(agents), *braking, NO_BRAKE][0]


def extreme_episodes(rows: list[Row], agent: str, seed: int) -> dict[str, Row]:
    """Return the extreme episodes of one agent and seed, by description; absent kinds are left out."""
    of_agent = [row for row in rows if row["agent"] == agent and row["seed"] == seed and row["error"] is None]
    of_agent.sort(key=lambda row: case_order(row["case"]))
    extremes = {
        description: max(filter(matches, of_agent), key=rank, default=None)
        for description, (matches, rank) in EXTREMES.items()
    }
    return {description: row for description, row in extremes.items() if row is not None}


def hardest_false_activations(rows: list[Row], agents: list[str], seed: int) -> list[Row]:
    """Return the false activations of one seed by agents that depend on the neuron, the hardest first."""
    candidates = neuron_agents(agents)
    false = [
        row for row in rows if row["agent"] in candidates and row["seed"] == seed and row["false_activation"]
    ]
    false.sort(key=lambda row: (-row["peak_deceleration"], row["case"], row["agent"]))
    return false[:MAX_FALSE_ACTIVATIONS]
