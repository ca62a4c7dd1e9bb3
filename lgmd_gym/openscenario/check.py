# pyright: standard
# Not strict: joblib states few types.
"""Comparison of played cells with the intent of their file.

The intent of a file: when, where and how fast the ego touches the target if it does not brake.

It is computed from the resolved parameters and positions of the file, without the compiled time scripts:

* With a `SynchronizeAction` of the target with the ego, contact is intended when the ego's reference point
  reaches its `TargetPositionMaster` at the initial speed along its path. The target's reference point is then
  at `TargetPosition`. Location: the middle of the target's front in the axes of the ego's body.
* For crossing pedestrians and bicyclists (`VRU_collisionPointOffset`), the location is that of the point this
  far ahead of the reference point: at the share `ImpactLocation` or `Overlap` of the ego's width, and in the
  middle without these parameters. The side from which the share counts is that of the synchronisation
  positions, because the files count it from the right (CBFA) or from the target's side (CPFA).
* Rear and head-on scenarios: the target's centre is at the share `ImpactLocation` of the ego's width, from
  the right; `Overlap` of a car is the overlapped share of the ego's width, and ±100 is aligned. The time
  follows from the initial distance and the speeds. For a target that brakes (`isTargetbraking`,
  `isCCRbraking`), it follows from headway, delay and deceleration; for one that starts
  (`Target_accelerationDist`, `Target_steadyStateDist`), from the time it needs for these distances after its
  trigger.
* CCFhol: contact is intended `GVT_laneChangeTTC` after the lane change of `Trajectory_laneChangeDistance` at
  constant speed, which begins at the synchronisation, with both cars aligned.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import copysign, cos, inf, nan, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.errors import check_path, check_whole
from lgmd_gym.openscenario.compiler import Compiled
from lgmd_gym.openscenario.nodes import Element, Node
from lgmd_gym.openscenario.reader import find_files, notes_of, read_cells
from lgmd_gym.openscenario.world import Mover, ScenarioMap


@dataclass(frozen=True, slots=True)
class Intent:
    """The intended contact."""

    time: float  # time in the file [s]
    speed: float  # ego speed [m/s]
    lateral: float  # position of a point of the target in the axes of the ego's body, + left [m]
    point: float  # distance of that point ahead of the target's reference point [m]


class _Values:
    """Parameters of a cell as numbers, by one of several names."""

    def __init__(self, scope: dict[str, str]) -> None:
        self._scope = scope

    def get(self, *names: str) -> float | None:
        text = next((self._scope[name] for name in names if name in self._scope), None)
        try:
            return None if text is None else float(text)
        except ValueError:
            return None

    def need(self, *names: str) -> float:
        value = self.get(*names)
        if value is None:
            raise KeyError(names[0])
        return value

    def flag(self, *names: str) -> bool:
        return any(self._scope.get(name) == "true" for name in names)


def intent_of(compiled: Compiled) -> Intent | None:
    """Return the intent of a cell; None if the file does not define one."""
    ego, target, values = compiled.ego, compiled.target, _Values(compiled.root.scope)
    if target is None:
        return None
    action = next(_synchronisations(compiled.root, target.name), None)
    try:
        if values.get("GVT_laneChangeTTC") is not None:
            return _lane_change(ego, target, values)
        if action is not None:
            return _synchronised(compiled.world, ego, target, action, values)
        return _along(ego, target, values)
    except KeyError:
        return None


def _synchronisations(root: Element, name: str) -> Iterator[Element]:
    """Yield the synchronisations of an entity."""
    for story in root.child("Storyboard").all("Story"):
        for act in story.all("Act"):
            for group in act.all("ManeuverGroup"):
                if any(item.text("entityRef") == name for item in group.child("Actors").all("EntityRef")):
                    yield from (Element(node, root.scope) for node in _nodes(group.node, "SynchronizeAction"))


def _nodes(node: Node, tag: str) -> Iterator[Node]:
    for child in node.children:
        if child.tag == tag:
            yield child
        yield from _nodes(child, tag)


def _synchronised(world: ScenarioMap, ego: Mover, target: Mover, action: Element, values: _Values) -> Intent:
    goal = ego.path.nearest(world.place(action.child("TargetPositionMaster")))
    speed = ego.timeline.initial_speed
    place = world.place(action.child("TargetPosition"))
    heading = target.path.at(target.path.nearest(place)).heading
    seen = place._replace(heading=heading).seen_from(ego.path.at(goal))
    point = values.get("VRU_collisionPointOffset")
    if point is None:
        return Intent(goal / speed, speed, seen.moved(target.front).y, target.front)
    share = values.get("ImpactLocation", "Overlap")
    beside = ego.body.width * abs((50.0 if share is None else share) / 100.0 - 0.5)
    return Intent(goal / speed, speed, copysign(beside, seen.moved(point).y), point)


def _along(ego: Mover, target: Mover, values: _Values) -> Intent:
    """Return the intent of a rear or head-on scenario."""
    speed, width = ego.timeline.initial_speed, ego.body.width
    share, overlap = values.get("ImpactLocation"), values.get("Overlap")
    if share is None and target.body.kind != "car":
        share = overlap
    if share is not None:
        lateral = width * (share / 100.0 - 0.5)
    elif overlap is None or abs(overlap) == 100.0:
        lateral = 0.0
    else:
        lateral = copysign(target.body.width / 2 + width / 2 - abs(overlap) / 100.0 * width, overlap)
    return Intent(_time(ego, target, values), speed, lateral, target.body.reference)


def _time(ego: Mover, target: Mover, values: _Values) -> float:
    """Return the time of the contact of a rear or head-on scenario [s]."""
    speed = values.need("Ego_speed_kph") / 3.6
    accelerating = values.get("Target_accelerationDist", "VRU_accelerationDist")
    if ego.backwards:
        return (values.need("Ego_initDist") - ego.rear - target.body.width / 2) / speed
    if accelerating is not None:
        final = values.need("Target_final_speed_kph", "VRU_finalSpeed_kph") / 3.6
        steady = values.need("Target_steadyStateDist", "VRU_steadyStateDist")
        trigger = values.need("Ego_initTTC") - (ego.front + target.rear) / speed
        return trigger + (2.0 * accelerating + steady) / final
    if values.get("startupTime") is not None:  # head-on
        other = values.need("Target_init_speed_kph", "Ego_speed_kph") / 3.6
        apart = (speed + other) * values.need("startupTime") - ego.front - target.front
        return apart / (speed + other)
    other = values.need("Target_init_speed_kph", "GVT_init_speed_kph") / 3.6
    if values.flag("isTargetbraking", "isCCRbraking"):
        return _braking_lead(values, speed, other)
    apart = values.need("Ego_initTimeHeadway") * speed - ego.front - target.rear
    return apart / (speed - other)


def _braking_lead(values: _Values, speed: float, other: float) -> float:
    """Return the time at which the ego reaches a car that brakes from the same speed [s]."""
    headway = values.get("GVT_headway")
    gap = headway if headway is not None else values.need("Target_time_headway") * speed
    delay = values.need("Target_braking_delay", "GVT_braking_delay")
    strength = values.need("Target_deceleration", "GVT_deceleration")
    final = values.need("Target_final_speed_kph", "GVT_final_speed_kph") / 3.6
    lasts = (other - final) / strength
    closed = strength * lasts**2 / 2
    if gap <= closed:
        return delay + sqrt(2.0 * gap / strength)
    return delay + lasts + (gap - closed) / (speed - final) if speed > final else inf


def _lane_change(ego: Mover, target: Mover, values: _Values) -> Intent:
    speed = values.need("Ego_speed_kph") / 3.6
    synchronised = values.need("startupTime") - ego.front / speed
    change = values.need("Trajectory_laneChangeDistance") / speed
    time = synchronised + change + values.need("GVT_laneChangeTTC")
    return Intent(time, speed, 0.0, target.body.reference)


@dataclass(frozen=True, slots=True)
class Impact:
    """The contact of an ego that does not brake."""

    time: float  # time in the file [s]
    speed: float  # ego speed [m/s]
    lateral: float  # position of the target's marked point in the axes of the ego's body, + left [m]


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """Result of a file; deviations are the largest absolute ones, NaN without an intent."""

    path: Path  # the file
    cells: int
    contacts: int  # number of cells in which the ego touches the target
    location: float  # deviation of the impact location [m]
    speed: float  # deviation of the impact speed [m/s]
    time: float  # deviation of the time of impact [s]
    notes: tuple[str, ...]  # notes of the reader, see `reader.notes_of`


def check_files(paths: Sequence[str | Path], jobs: int = 1) -> Iterator[CheckedFile]:
    """Play all cells of files and folders without braking, and yield one result per file.

    Args:
        paths: Files, or folders as in `read_all`.
        jobs: Number of processes.

    Raises:
        ValueError: See `read`.
    """
    from joblib import Parallel, delayed

    files = [file for path in paths for file in find_files(check_path("path", path))]
    jobs = min(check_whole("jobs", jobs, 1), len(files))
    results: Any = Parallel(n_jobs=jobs, return_as="generator")(delayed(check_file)(file) for file in files)
    yield from results


def check_file(path: Path) -> CheckedFile:
    """Play all cells of a file and compare them with their intent; see `intent`."""
    cells, contacts, deviations = read_cells(path), 0, list[tuple[float, float, float]]()
    for cell in cells:
        intent = intent_of(cell.compiled)
        impact = play(cell.compiled, 0.0 if intent is None else intent.point)
        contacts += impact is not None
        if impact is not None and intent is not None:
            lateral, speed = abs(impact.lateral - intent.lateral), abs(impact.speed - intent.speed)
            deviations.append((lateral, speed, abs(impact.time - intent.time)))
    worst = np.max(deviations or [(nan, nan, nan)], axis=0)
    return CheckedFile(path, len(cells), contacts, *worst.tolist(), notes=notes_of(cells))


def play(compiled: Compiled, point: float) -> Impact | None:
    """Play a cell without braking; return the contact with its target, None without one.

    Args:
        compiled: The cell.
        point: Distance of the marked point ahead of the target's reference point [m].
    """
    from lgmd_gym.envs.braking import BrakingEnv

    env, hold = BrakingEnv(compiled.scenario), np.zeros(1, np.float32)
    env.reset(seed=0)
    done = False
    while not done:
        _, _, terminated, truncated, _ = env.step(hold)
        done = terminated or truncated
    bodies, episode = env.simulation.state.bodies[0], env.simulation.state.episodes[0]
    env.close()
    if episode["touched"] == 0 or episode["touched"] != episode["target"]:
        return None
    ego, other, target = bodies[0], bodies[episode["touched"]], compiled.target
    assert target is not None
    from_centre = point - target.body.reference
    if target.backwards:
        from_centre = -from_centre
    x = other["x"] + from_centre * cos(other["heading"]) - ego["x"]
    y = other["y"] + from_centre * sin(other["heading"]) - ego["y"]
    lateral = x * sin(ego["heading"]) - y * cos(ego["heading"])  # highway-env's y is + right
    driven = compiled.ego.timeline.at(compiled.start).distance + float(ego["travelled"])
    return Impact(compiled.ego.timeline.time_of(driven), float(ego["speed"]), float(lateral))
