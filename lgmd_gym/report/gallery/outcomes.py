"""The results of agents in the scenarios of the gallery."""

from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.task import NO_BRAKE, Task, run_task
from lgmd_gym.envs.registration import RANDOM, RANDOM_TASKS
from lgmd_gym.report.gallery.cards import ScenarioCard


class AgentOutcome(NamedTuple):
    """Result of an agent over the seeds of a scenario.

    Attributes:
        text: Result in words.
        passed: Whether every threat was avoided, and no episode had a false activation or an error.
        threat: Whether the scenario is a threat in any of the episodes.
    """

    text: str
    passed: bool
    threat: bool

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "AgentOutcome":
        """Return the outcome of the rows of one agent."""
        threats = [row for row in rows if row["threat"]]
        if any(row["error"] is not None for row in rows):
            return cls("failed", False, bool(threats))
        non_threats = [row for row in rows if not row["threat"]]
        parts = []
        if threats:
            parts.append(f"avoided {sum(row['avoided'] for row in threats)}/{len(threats)}")
            impacts = [3.6 * row["relative_impact_speed"] for row in threats if row["collision"]]
            if impacts:
                parts.append(f"contact at {median(impacts):.0f} km/h")
            if any(row["premature_brake"] for row in threats):
                parts.append("braked too early")
        if non_threats:
            contacts = sum(row["collision"] for row in non_threats)
            false_activations = sum(row["false_activation"] for row in non_threats)
            parts.append(f"false activations {false_activations}/{len(non_threats)}")
            if contacts:
                parts.append(f"contact {contacts}/{len(non_threats)}")
        passed = all(row["avoided"] for row in threats) and not any(
            row["false_activation"] or row["collision"] for row in non_threats
        )
        return cls(", ".join(parts), passed, bool(threats))


def evaluate_agents(card: ScenarioCard, agents: Sequence[str], seeds: int) -> dict[str, AgentOutcome]:
    """Return the outcome of each agent and of no-brake; empty for traffic."""
    if card.traffic:
        return {}
    name, task = f"gallery/{card.name}/default", RANDOM_TASKS.get(card.name)
    case = Case(name, RANDOM, tuple(task.arguments.items())) if task else Case(name, card.name)
    results = [run_task(Task(NO_BRAKE, case, seed, SensorConfig())) for seed in range(seeds)]
    outcomes = {NO_BRAKE: AgentOutcome.of([result.row for result in results])}
    for agent in agents:
        if agent != NO_BRAKE:
            tasks = [
                Task(agent, case, seed, SensorConfig(), result.counterfactual)
                for seed, result in enumerate(results)
            ]
            outcomes[agent] = AgentOutcome.of([run_task(task).row for task in tasks])
    return outcomes
