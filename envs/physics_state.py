"""`PhysicsState`: the state of one or more episodes as arrays."""

from math import cos, sin
from typing import NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.bodies import (
    BICYCLE,
    BODY,
    BOX,
    CAR,
    EGO,
    EGO_STATE,
    MOTORCYCLE,
    PEDESTRIAN,
    ROAD_MARKING,
    STEP_START,
)
from lgmd_gym.envs.dynamics.brake import DELAY_LINE
from lgmd_gym.envs.dynamics.episode import EPISODE
from lgmd_gym.envs.dynamics.longitudinal import segment_table
from lgmd_gym.envs.dynamics.path import path_table
from lgmd_gym.envs.dynamics.script import Bend, Pose
from lgmd_gym.envs.families.scenario import LANE_WIDTH, Actor, Scenario

BODY_KINDS = {
    "car": CAR,
    "box": BOX,
    "road_marking": ROAD_MARKING,
    "pedestrian": PEDESTRIAN,
    "bicycle": BICYCLE,
    "motorcycle": MOTORCYCLE,
}
EGO_HEIGHT = 1.5  # [m]
SHADES = (30, 220)  # range of random grey levels
START_RANGE = 500.0  # [m], range of the random start position, which varies the road texture


class Placement(NamedTuple):
    """A scenario placed on the road, ready to be loaded into a `PhysicsState`.

    The target is the first solid actor of the scenario.
    """

    scenario: Scenario
    start: Pose  # initial pose of the ego
    actors: tuple[Actor, ...]  # actors in the order of their bodies: cars, then other objects
    bodies: np.ndarray  # `BODY` records, the ego first; rows of paths and segments count from 0
    segments: np.ndarray  # table of the scripts' segments, float64, shape (n, 4)
    paths: np.ndarray  # table of the paths' cells, float64, shape (n, 6)
    target: int  # index of the target's body; 0 without a solid actor


def place(scenario: Scenario, rng: np.random.Generator) -> Placement:
    """Place a scenario at a random start, with a random grey level for every actor without a `shade`."""
    start = Pose(float(rng.uniform(0.0, START_RANGE)), scenario.road.ego_lane * LANE_WIDTH, 0.0)
    drawn = [int(rng.integers(*SHADES, endpoint=True)) for _ in scenario.actors]
    shaded = list(zip(scenario.actors, drawn, strict=True))
    # highway-env keeps cars and other objects in two lists, and the camera reads them in this order.
    shaded.sort(key=lambda item: item[0].kind != "car")
    bodies = np.zeros(1 + len(shaded), BODY)
    ego = bodies[0]
    ego["x"], ego["y"], ego["heading"], ego["speed"] = *start, scenario.ego_speed
    ego["length"], ego["width"], ego["height"] = scenario.ego_length, scenario.ego_width, EGO_HEIGHT
    ego["reference"], ego["kind"] = scenario.ego_reference, EGO
    tables = [_path_of(start, scenario.ego_reference, scenario.ego_path)]
    scripts = [segment_table(scenario.ego_profile)]
    poses: list[Pose] = []
    for actor, _ in shaded:
        centre = start.x + scenario.ego_length / 2 + actor.gap + actor.length / 2
        poses.append(Pose(centre, start.y - actor.lateral_offset, -actor.heading))
        tables.append(_path_of(poses[-1], actor.reference, actor.path))
        scripts.append(segment_table(actor.profile))
    others = bodies[1:]
    for name in ("x", "y", "heading"):
        others[name] = [getattr(pose, name) for pose in poses]
    for name in ("speed", "length", "width", "height", "reference"):
        others[name] = [getattr(actor, name) for actor, _ in shaded]
    others["shade"] = [shade if actor.shade is None else actor.shade for actor, shade in shaded]
    others["kind"] = [BODY_KINDS[actor.kind] for actor, _ in shaded]
    bodies["script_speed"] = bodies["speed"]
    bodies["segment_end"] = np.cumsum([len(script) for script in scripts])
    bodies["segment"][1:] = bodies["segment_end"][:-1]
    bodies["path_end"] = np.cumsum([len(table) for table in tables])
    bodies["path"][1:] = bodies["path_end"][:-1]
    solid = [actor for actor in scenario.actors if actor.kind != "road_marking"]
    target = 1 + next(i for i, (actor, _) in enumerate(shaded) if actor is solid[0]) if solid else 0
    return Placement(
        scenario=scenario,
        start=start,
        actors=tuple(actor for actor, _ in shaded),
        bodies=bodies,
        segments=np.concatenate(scripts),
        paths=np.concatenate(tables),
        target=target,
    )


def _path_of(centre: Pose, reference: float, bends: tuple[Bend, ...]) -> np.ndarray:
    """Return the cells of the path of the point `reference` [m] behind a body's centre."""
    x, y = centre.x - reference * cos(centre.heading), centre.y - reference * sin(centre.heading)
    return path_table(Pose(x, y, centre.heading), bends)


class PhysicsState:
    """The episodes of N environments as arrays; the arguments of the compiled functions.

    Args:
        num: Number of environments N.

    Attributes:
        bodies: `BODY` records, shape (N, bodies).
        episodes: `EPISODE` records, shape (N,).
        egos: `EGO_STATE` records, shape (N,).
        lines: `DELAY_LINE` records, shape (N,).
        pending: Demands in the delay lines, float64, shape (N, demands, 2).
        segments: Tables of the scripts' segments, float64, shape (N, segments, 4).
        paths: Tables of the paths' cells, float64, shape (N, cells, 6).
        before: Scratch memory, `STEP_START` records, shape (N, bodies + 1).
        parts: Scratch memory, see `step_ego`; float64, shape (N, demands + 1, 2).
    """

    def __init__(self, num: int) -> None:
        self.bodies = np.zeros((num, 1), BODY)
        self.episodes = np.zeros(num, EPISODE)
        self.egos = np.zeros(num, EGO_STATE)
        self.lines = np.zeros(num, DELAY_LINE)
        self.pending = np.zeros((num, 1, 2))
        self.segments = np.zeros((num, 1, 4))
        self.paths = np.zeros((num, 1, 6))
        self.before = np.zeros((num, 2), STEP_START)
        self.parts = np.zeros((num, 2, 2))

    def load(self, index: int, placement: Placement, max_demands: int) -> bool:
        """Start an episode in an environment.

        Args:
            index: Index of the environment.
            placement: The scenario.
            max_demands: Maximum number of demands in its delay line, see `BrakeParams.max_demands`.

        Returns:
            Whether arrays were replaced by larger ones.
        """
        scenario, count = placement.scenario, len(placement.bodies)
        grown = self._reserve(
            bodies=count,
            before=count + 1,
            segments=len(placement.segments),
            paths=len(placement.paths),
            pending=max_demands,
            parts=max_demands + 1,
        )
        self.bodies[index, :count] = placement.bodies
        self.segments[index, : len(placement.segments)] = placement.segments
        self.paths[index, : len(placement.paths)] = placement.paths
        for records in (self.lines, self.egos, self.episodes):
            records[index] = 0
        self.egos["on_script"][index] = 1
        episodes = self.episodes
        episodes["bodies"][index], episodes["target"][index] = count, placement.target
        episodes["impact_speed"][index] = episodes["relative_impact_speed"][index] = np.inf
        episodes["duration"][index], episodes["top_speed"][index] = scenario.duration, scenario.top_speed
        episodes["last_speed"][index] = scenario.ego_speed
        return grown

    def _reserve(self, **needed: int) -> bool:
        """Enlarge the named arrays to at least these numbers of rows; returns whether one was replaced."""
        grown = False
        for name, rows in needed.items():
            old = getattr(self, name)
            if old.shape[1] < rows:
                new = np.zeros((old.shape[0], rows, *old.shape[2:]), old.dtype)
                new[:, : old.shape[1]] = old
                setattr(self, name, new)
                grown = True
        return grown
