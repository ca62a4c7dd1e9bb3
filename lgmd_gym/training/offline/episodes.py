# pyright: standard
# Not strict: joblib states few types.
"""Recorded episodes with the time to brake at each of their decisions, and their files."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias
from zipfile import BadZipFile

import numpy as np
from joblib import delayed

from lgmd_gym.agents.policies.features import FRAME, SCALES, shrink_frames
from lgmd_gym.aliases import Observation, Values
from lgmd_gym.engine.first_use import compile_kernels
from lgmd_gym.processes.files import complete_file, is_intact_zip
from lgmd_gym.processes.pool import run_parallel

CHUNK_SIZE = 4  # seeds recorded by one task of a process
SIGNALS = (*SCALES, "column_potential")  # recorded if present
TRAFFIC = "traffic"  # `family` of episodes in traffic


@dataclass(frozen=True)
class DrivenEpisode:
    """One episode with random braking, of T environment decisions, for policies of any decision rate."""

    # observations by name, (T, ...) each; `frame` is shrunk and present on request only
    observations: Observation
    # time for which full braking can wait from each decision on, float32 (T,) [s]; 0 from the last moment on,
    # inf without a contact
    time_to_brake: np.ndarray
    demands: np.ndarray  # longitudinal demand at each decision, float32 (T,)
    threat: bool  # whether some decision has a finite time to brake
    family: str = ""  # scenario family of the level; "traffic" in traffic, empty if unknown

    def __len__(self) -> int:
        return len(self.demands)


RecordFunction: TypeAlias = Callable[[range], list[list[DrivenEpisode]]]
"""Method `record` of a recorder: the episodes of each seed."""


def record_parallel(
    record: RecordFunction, seeds: range, jobs: int = 1, chunk_size: int = CHUNK_SIZE
) -> Iterator[list[DrivenEpisode]]:
    """Yield the episodes of each seed, recorded by several processes.

    Args:
        record: Method of a recorder.
        seeds: Seeds of the environment.
        jobs: Number of processes.
        chunk_size: Largest number of seeds recorded by one task of a process.
    """
    compile_kernels()  # before the processes, which would all do so
    size = max(min(chunk_size, -(-len(seeds) // jobs)), 1)
    chunks = [seeds[start : start + size] for start in range(0, len(seeds), size)]
    for by_seed in run_parallel((delayed(record)(chunk) for chunk in chunks), jobs):
        yield from by_seed


def select_signals(observation: Observation, shrink: int | None = None) -> Observation:
    """Return the recorded part of an observation.

    Args:
        observation: Observation of `LGMDObservation`.
        shrink: Side of the pixel squares that become one pixel of the recorded frame [px]; None for no frame.
    """
    signals = {name: observation[name] for name in SIGNALS if name in observation}
    return (
        signals if shrink is None else signals | {FRAME: shrink_frames(observation[FRAME][None], shrink)[0]}
    )


def stack(observations: list[Observation]) -> Observation:
    """Return the observations of an episode by name, (T, ...) each."""
    return {name: np.stack([item[name] for item in observations]) for name in observations[0]}


PER_DECISION = ("time_to_brake", "demands")  # arrays of an episode, beside the observations
PREFIX = "observations/"


def save(by_seed: Sequence[Sequence[DrivenEpisode]], file: Path, origin: Values) -> None:
    """Write episodes to a file; an interrupted write leaves no file.

    Args:
        by_seed: Episodes of each seed; a traffic episode gives any number of segments.
        file: File to write.
        origin: Settings that the episodes were recorded with, as plain values.
    """
    episodes = [episode for group in by_seed for episode in group]
    arrays: Values = {
        "origin": np.array(json.dumps(origin)),
        "counts": np.array([len(group) for group in by_seed]),
        "lengths": np.array([len(episode) for episode in episodes]),
        "threats": np.array([episode.threat for episode in episodes], bool),
        "families": np.array([episode.family for episode in episodes], str),
    }
    if episodes:
        for name in PER_DECISION:
            arrays[name] = np.concatenate([getattr(episode, name) for episode in episodes])
        for name in episodes[0].observations:
            arrays[PREFIX + name] = np.concatenate([episode.observations[name] for episode in episodes])
    with complete_file(file) as part, part.open("wb") as out:
        np.savez_compressed(out, **arrays)


def is_complete(file: Path) -> bool:
    """Return whether `save` finished a file and nothing damaged it since."""
    return is_intact_zip(file, "origin.npy")


def load(file: Path) -> list[list[DrivenEpisode]]:
    """Return the episodes in a file, by seed.

    Raises:
        ValueError: If the file contains no recorded episodes.
    """
    with _open(file) as archive:
        episodes = _episodes(archive)
        return [[next(episodes) for _ in range(count)] for count in archive["counts"]]


def check_file(file: Path, origin: Values, remedy: str = "train in a new folder") -> int:
    """Return the number of seeds in a file without loading its episodes.

    Args:
        file: File written by `save`.
        origin: Required settings; the file may have others.
        remedy: What to do about other settings, for the message.

    Raises:
        ValueError: If the file contains no recorded episodes, or was recorded with other settings.
    """
    with _open(file) as archive:
        recorded = json.loads(str(archive["origin"]))
        for key, value in origin.items():
            if recorded.get(key) != value:
                raise ValueError(
                    f"the episodes in {str(file)!r} were recorded with another {key} "
                    f"({', not '.join(map(_abbreviated, _difference(recorded.get(key), value)))}); {remedy}"
                )
        return len(archive["counts"])


def _difference(recorded: object, required: object) -> tuple[object, object]:
    """Return the first different elements of two lists or dicts, at any depth, or else the two values."""
    pairs: list[tuple[object, object]] = []
    if isinstance(recorded, list) and isinstance(required, list) and len(recorded) == len(required):
        pairs = list(zip(recorded, required, strict=True))
    elif isinstance(recorded, dict) and isinstance(required, dict):
        keys = dict.fromkeys([*required, *recorded])
        pairs = [({key: recorded.get(key)}, {key: required.get(key)}) for key in keys]
        if len(keys) == 1:
            return recorded, required
    for pair in pairs:
        if pair[0] != pair[1]:
            return _difference(*pair)
    return recorded, required


def _abbreviated(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _open(file: Path) -> Any:
    try:
        archive = np.load(file)
        for name in ("origin", "counts"):
            if name not in archive:
                raise ValueError(f"no entry {name!r}")
    except (OSError, EOFError, ValueError, BadZipFile) as error:
        raise ValueError(f"{str(file)!r} contains no recorded episodes ({error})") from None
    return archive


def _episodes(archive: Any) -> Iterator[DrivenEpisode]:
    arrays = {name: archive[name] for name in archive.files if name not in ("origin", "counts")}
    observations = {
        name.removeprefix(PREFIX): array for name, array in arrays.items() if name.startswith(PREFIX)
    }
    bounds = np.cumsum([0, *arrays["lengths"]])
    for index in range(len(arrays["lengths"])):
        part = slice(*bounds[index : index + 2])
        yield DrivenEpisode(
            {name: array[part] for name, array in observations.items()},
            *(arrays[name][part] for name in PER_DECISION),
            threat=bool(arrays["threats"][index]),
            family=str(arrays["families"][index]),
        )
