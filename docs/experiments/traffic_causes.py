"""Road users near the ego at the false activations of an agent in traffic.

    python docs/experiments/traffic_causes.py RUN --agent policy:all-round --jobs 2

The argument is a run folder of `lgmd-gym bench --suite traffic`. Drives in which all braking events of the
agent are false are played again up to the first one that exceeds 0.25 g. A line of the table is what is in
front of the ego when this event begins. Only vehicles in front of the ego, at most 30 m from centre to centre
from it, are considered; the first description that applies counts:

- car ahead: heads within 30° of the ego's direction, at most 1.5 m to its side;
- crossing: heads 30° to 150° away from it;
- oncoming: heads more than 150° away from it;
- other: heads within 30° of it, farther to the side;
- none: no such vehicle.

Speeds and distances are medians. The table is in Markdown.
"""

import argparse
from collections.abc import Iterable, Sequence
from math import cos, degrees, hypot, inf, pi, sin
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents import HOLD, make_agent
from lgmd_gym.benchmark.case import Row, is_traffic
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.metrics import NUISANCE
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.replay import EVENT_PAUSE
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.registration import TRAFFIC_KINDS
from lgmd_gym.errors import check_known
from lgmd_gym.rendering.playback import make_target

SITUATIONS = ("car ahead", "crossing", "oncoming", "other", "none")
RANGE, LANE = 30.0, 1.5  # distance ahead, and to the side of a car ahead [m]
ALONG, AGAINST = 30.0, 150.0  # angle between the headings of a car ahead and of an oncoming one [degrees]


class Onset(NamedTuple):
    """Start of a braking event.

    Attributes:
        situation: One of `SITUATIONS`.
        speed: Ego speed [m/s].
        distance: Distance of the nearest vehicle of the situation [m]; infinite for none.
    """

    situation: str
    speed: float
    distance: float


def situation_of(ego: Any, vehicles: Iterable[Any]) -> tuple[str, float]:
    """Return what is in front of the ego, and its distance [m]."""
    found = dict.fromkeys(SITUATIONS, inf)
    forward = np.array([cos(ego.heading), sin(ego.heading)])
    for vehicle in vehicles:
        ahead = float((vehicle.position - ego.position) @ forward)
        aside = float((vehicle.position - ego.position) @ [-forward[1], forward[0]])
        distance = hypot(ahead, aside)
        if vehicle is ego or ahead <= 0.0 or distance > RANGE:
            continue
        turned = abs(degrees((vehicle.heading - ego.heading + pi) % (2.0 * pi) - pi))
        if turned <= ALONG:
            name = "car ahead" if abs(aside) <= LANE else "other"
        else:
            name = "oncoming" if turned >= AGAINST else "crossing"
        found[name] = min(found[name], distance)
    return next(((name, value) for name, value in found.items() if value < inf), ("none", inf))


def first_event(config: RunConfig, agent_name: str, row: Row) -> Onset:
    """Play a drive up to the first braking event of the agent that exceeds 0.25 g, and return its start.

    Raises:
        RuntimeError: If there is no such event.
    """
    agent, kind = make_agent(agent_name), row["family"]
    sensors = SensorConfig(config.camera, config.params).for_agent(agent)
    world = LABORATORY if row["world"] is None else row["world"]
    place = {"world": world, "weather": row["condition"], "road": config.road}
    env = make_target(f"{config.suite}/{kind}", {}, **sensors.arguments, **place)
    observation, info = env.reset(seed=row["seed"])
    agent.reset(row["seed"])
    onset, pause, done = None, 0.0, False
    while not done:
        demand = agent.act(observation, info)
        road: Any = env.unwrapped
        pause = 0.0 if float(demand[0]) < HOLD else pause + 1.0 / road.config["policy_frequency"]
        if pause > EVENT_PAUSE:
            onset = None
        elif pause == 0.0 and onset is None:
            name, distance = situation_of(road.ego, road.road.vehicles)
            onset = Onset(name, float(road.ego.speed), distance)
        observation, _, terminated, truncated, info = env.step(demand)
        done = terminated or truncated
        if onset is not None and info["deceleration"] > NUISANCE:
            return onset
    raise RuntimeError(f"{agent_name} does not brake in {row['case']}, world {row['world']}")


def table(onsets: Sequence[tuple[str, Onset]]) -> list[str]:
    """Return the lines of the table of the kinds of traffic and the onsets."""
    kinds = [kind for kind in TRAFFIC_KINDS if any(kind == item for item, _ in onsets)]
    lines = [["in front of the ego", *kinds, "all", "ego speed [m/s]", "distance [m]"]]
    lines.append(["---"] * len(lines[0]))
    for name in SITUATIONS:
        of_name = [(kind, onset) for kind, onset in onsets if onset.situation == name]
        if of_name:
            counts = [sum(item == kind for item, _ in of_name) for kind in kinds]
            far = median(onset.distance for _, onset in of_name)
            medians = [
                f"{median(onset.speed for _, onset in of_name):.1f}",
                "–" if far == inf else f"{far:.1f}",
            ]
            lines.append([name, *map(str, [*counts, len(of_name)]), *medians])
    return [f"| {' | '.join(line)} |" for line in lines]


def play(run: StoredRun, agent: str, jobs: int) -> list[tuple[str, Onset]]:
    """Return the kind of traffic and the start of the first event of each drive with false events only.

    Raises:
        ValueError: If the run is not one of traffic, does not contain the agent, or has no such drive.
    """
    if not is_traffic(run.config.suite):
        raise ValueError(f"the run is one of {run.config.suite}; pass one of lgmd-gym bench --suite traffic")
    check_known("agent of the run", agent, run.config.agents)
    rows = [row for row in run.rows if row["agent"] == agent and row["error"] is None]
    only_false = [row for row in rows if 0 < row["brakes"] == row["false_activations"]]
    if not only_false:
        raise ValueError(f"the run has no drive in which all braking events of {agent} are false")
    onsets = Parallel(n_jobs=jobs)(delayed(first_event)(run.config, agent, row) for row in only_false)
    return [(row["family"], onset) for row, onset in zip(only_false, onsets, strict=True)]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Road users near the ego at false activations in traffic")
    parser.add_argument("run", type=Path, help="run folder of lgmd-gym bench --suite traffic")
    parser.add_argument("--agent", required=True, help="agent of the run")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    options = parser.parse_args()
    try:
        print(*table(play(read_run(options.run), options.agent, options.jobs)), sep="\n")
    except (ValueError, RuntimeError) as error:
        parser.error(str(error))
