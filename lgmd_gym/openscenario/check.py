"""Comparison of played cells with the intent of their file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.errors import check_path, check_whole
from lgmd_gym.openscenario.compiler import Compiled
from lgmd_gym.openscenario.intent import intent_of
from lgmd_gym.openscenario.reader import find_files, read_cells


@dataclass(frozen=True, slots=True)
class Impact:
    """The contact of an ego that does not brake.

    Attributes:
        time: Time in the file [s].
        speed: Ego speed [m/s].
        lateral: Position of the target's marked point in the axes of the ego's body, + left [m].
    """

    time: float
    speed: float
    lateral: float


@dataclass(frozen=True, slots=True)
class CheckedFile:
    """Result of a file; deviations are the largest absolute ones, NaN without an intent.

    Attributes:
        path: The file.
        cells: Number of cells.
        contacts: Number of cells in which the ego touches the target.
        location: Deviation of the impact location [m].
        speed: Deviation of the impact speed [m/s].
        time: Deviation of the time of impact [s].
    """

    path: Path
    cells: int
    contacts: int
    location: float
    speed: float
    time: float


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
            lateral = float("nan") if intent.lateral is None else abs(impact.lateral - intent.lateral)
            deviations.append((lateral, abs(impact.speed - intent.speed), abs(impact.time - intent.time)))
    rows = np.array(deviations or [(float("nan"),) * 3])
    worst = np.where(np.isnan(rows).all(axis=0), np.nan, np.nanmax(np.nan_to_num(rows, nan=-1.0), axis=0))
    return CheckedFile(path, len(cells), contacts, *worst.tolist())


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
    physics = env.road.physics
    bodies, episode = physics[0][0], physics[1][0]
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
