"""Units of work: tasks that one process plays together."""

import contextlib
import math
from collections.abc import Hashable, Iterable
from functools import cache
from itertools import pairwise
from typing import NamedTuple
from uuid import uuid4

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.task import Task
from lgmd_gym.camera import Camera
from lgmd_gym.sensing.channel import make_channels

MAX_TASKS = 64  # tasks of a unit, whose results leave a worker process together


class Unit(NamedTuple):
    """Tasks that share agent, sensors and rates."""

    run: str  # identifier of the call of `make_units`; files of agents may change between calls
    tasks: list[Task]  # the tasks, at least one
    agents: tuple[str, ...] = ()  # agents to make before the first unit of a worker process


def make_units(tasks: Iterable[Task], workers: int, agents: tuple[str, ...] = ()) -> list[Unit]:
    """Return tasks as units of work; with several workers, those with the most pixels first.

    Args:
        tasks: The tasks.
        workers: Number of processes, which determines the size of the units.
        agents: All agents of the run. A worker process makes them at its first unit: joblib replaces a
            process whose memory grows between units, as it does when a policy imports PyTorch.
    """
    tasks = list(tasks)
    groups: dict[Hashable, list[Task]] = {}
    for task in tasks:
        groups.setdefault(group_key(task), []).append(task)
    units: list[Unit] = []
    run = uuid4().hex
    if workers == 1:
        return [Unit(run, group) for group in groups.values()]
    size = min(MAX_TASKS, -(-len(tasks) // (4 * workers)))
    for group in sorted(groups.values(), key=_pixels, reverse=True):  # a long unit at the end would run alone
        count = -(-len(group) // size)
        bounds = [len(group) * k // count for k in range(count + 1)]
        units += [Unit(run, group[start:end], agents) for start, end in pairwise(bounds)]
    return units


def group_key(task: Task) -> Hashable:
    """Return what the tasks of a unit share."""
    arguments = task.arguments
    shared = task.sensor_config, arguments.get("config"), arguments.get("fps")
    return task.agent, task.condition, task.has_driver, repr(shared)


@cache
def make_once(agents: tuple[str, ...]) -> None:
    """Make agents and drop them, so that this process has imported what they need."""
    for agent in agents:
        with contextlib.suppress(Exception, SystemExit):  # an error belongs to the tasks of the agent
            make_agent(agent)


def _pixels(group: list[Task]) -> int:
    """Return the number of pixels per camera frame of a group; 0 for top views and invalid agents."""
    task = group[0]
    try:
        sensors = task.sensor_config.for_agent(make_agent(task.agent)).arguments
        cameras = [channel.camera for channel in make_channels(sensors["camera"])]
    except (Exception, SystemExit):
        return 0
    return sum(math.prod(item.shape) for item in cameras if isinstance(item, Camera))
