"""Returns of reference agents in every registered environment.

    python docs/reference_returns.py docs/returns.csv

The environments have their default arguments, so that each episode is in another training world. Episode i
has seed i. The pages of the environments show the results.
"""

import csv
import sys
from pathlib import Path
from statistics import fmean, stdev
from typing import Any, NamedTuple

import gymnasium as gym

import lgmd_gym  # noqa: F401  (registers the environments)
from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import rollout
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.registration import RANDOM_TASKS, SCENARIO, TRAFFIC_KINDS, traffic_id

AGENTS = ("random", "no-brake", "spike-threshold", "ttc-oracle")
"""Agents in the order of the tables; "random" draws every action from the action space."""
EPISODES, TRAFFIC_EPISODES = 10, 4
EXAMPLE = {"family": "example", "ego_speed": 12.0, "duration": 9.0, "actors": [{"gap": 45.0, "speed": 3.0}]}
"""The scenario of the reference returns of `LGMD/Scenario-v0`: a slower car ahead."""


class Returns(NamedTuple):
    """Results of one agent in one environment.

    Attributes:
        id: Id of the environment.
        agent: One of `AGENTS`.
        episodes: Number of episodes.
        mean: Mean of the undiscounted returns.
        std: Standard deviation of the returns.
        contacts: Number of episodes with contact.
        duration: Mean duration of the episodes [s].
    """

    id: str
    agent: str
    episodes: int
    mean: float
    std: float
    contacts: int
    duration: float


class RandomActions:
    """Draws every action from the action space."""

    alert = False

    def __init__(self, space: gym.Space[Any]) -> None:
        self.space = space

    def reset(self, seed: int | None = None) -> None:
        """Seed the action space."""
        self.space.seed(seed)

    def act(self, observation: dict[str, Any], info: dict[str, Any]) -> Any:
        """Return a random action."""
        return self.space.sample()


def environments() -> dict[str, int]:
    """Return the ids of all environments with their numbers of episodes."""
    braking = {env_id(name): EPISODES for name in (*FAMILIES, *RANDOM_TASKS, SCENARIO)}
    return braking | {traffic_id(kind): TRAFFIC_EPISODES for kind in TRAFFIC_KINDS}


def arguments_of(name: str) -> dict[str, Any]:
    """Return the arguments that an environment requires."""
    return {"scenario": EXAMPLE} if name == env_id(SCENARIO) else {}


def measure(name: str, agent_name: str, episodes: int) -> Returns:
    """Return the results of one agent in one environment, with seeds from 0."""
    agent = None if agent_name == "random" else make_agent(agent_name)
    # Without a camera, an agent that does not read the neuron has the same episodes in less time.
    camera = "fovea" if agent and agent.reads_neuron else None
    env = gym.make(name, camera=camera, **arguments_of(name))
    agent = agent or RandomActions(env.action_space)
    totals, seconds, contacts = [], [], 0
    for seed in range(episodes):
        steps = [step for step, _ in rollout(env, agent, seed)]
        totals.append(sum(step.reward for step in steps))
        seconds.append((len(steps) - 1) / env.unwrapped.config["policy_frequency"])  # type: ignore[attr-defined]
        contacts += steps[-1].info["collision"]
    env.close()
    return Returns(name, agent_name, episodes, fmean(totals), stdev(totals), contacts, fmean(seconds))


def read_returns(path: Path) -> dict[str, list[Returns]]:
    """Return the results in a file by environment."""
    found: dict[str, list[Returns]] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            kinds = Returns.__annotations__.items()
            item = Returns(**{key: kind(row[key]) for key, kind in kinds})
            found.setdefault(item.id, []).append(item)
    return found


def main(path: Path) -> None:
    """Measure the returns of all agents in all environments and write them to a CSV file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Returns._fields)
        for name, episodes in environments().items():
            for agent in AGENTS:
                row = measure(name, agent, episodes)
                mean, std, duration = f"{row.mean:.3f}", f"{row.std:.3f}", f"{row.duration:.2f}"
                writer.writerow([*row[:3], mean, std, row.contacts, duration])
                file.flush()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "returns.csv"))
