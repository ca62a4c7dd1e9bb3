"""Recorded episodes of a training run: newly recorded, or reused from another run."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import chain
from json import dumps, loads
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym

import lgmd_gym
from lgmd_gym.aliases import Values
from lgmd_gym.camera import BirdsEye
from lgmd_gym.envs.registration import TRAFFIC_KINDS
from lgmd_gym.envs.traffic.emergencies import HORIZON
from lgmd_gym.errors import counted
from lgmd_gym.sensing.channel import make_channels
from lgmd_gym.training.config import (
    SEED_STRIDE,
    SET_STRIDE,
    VALIDATION_SEED,
    ExtraEpisodes,
    TrainConfig,
    parse_levels,
    parse_traffic,
)
from lgmd_gym.training.offline.driving import DriveRecorder
from lgmd_gym.training.offline.episodes import (
    CHUNK_SIZE,
    DrivenEpisode,
    RecordFunction,
    check_file,
    is_complete,
    load,
    record_parallel,
    save,
)
from lgmd_gym.training.offline.traffic import TrafficRecorder

LEVEL_CHUNK_SIZE = 25  # levels recorded by one task of a process, for the environments of the engine
FILE_SIZE = 100  # largest number of seeds in one file
TRAFFIC_RATIO = 4  # training episodes in traffic per validation episode in traffic
EXTRA_RATIO = 20  # extra levels for training per extra level for validation
REUSED = "omit --recordings, or record in a new training folder"  # for recordings with other settings
FORMAT = 6  # of the files; recordings of another format are rejected


class LevelKind(NamedTuple):
    """A kind of additional levels."""

    option: str  # attribute of `TrainConfig`
    prefix: str  # of the names of its sets
    stride: int  # distance between the first seeds of its sets; 0 for the same first seed
    arguments: Values  # arguments of the environment


# Sets of `extra_levels` have the same seeds, so that one can be the levels of another without their target.
LEVEL_KINDS = (
    LevelKind("extra_levels", "extra", 0, {}),
    LevelKind("error_levels", "errors", SET_STRIDE, {"sensor_errors": 1.0}),
)


@dataclass(frozen=True)
class RecordingSet:
    """Recorded episodes of one kind."""

    # name of the folder: "train" or "validation", for more after "extra1-", "errors1-", "traffic-" or
    # "extra-traffic1-"
    name: str
    seeds: range  # seeds of the environment
    record: RecordFunction  # returns the episodes of each seed
    option: str = ""  # options of the command line that record these episodes
    settings: Values = field(default_factory=Values)  # settings that only these episodes depend on
    chunk_size: int = LEVEL_CHUNK_SIZE  # largest number of seeds recorded by one task of a process


def recording_sets(config: TrainConfig, split: str) -> list[RecordingSet]:
    """Return the recordings that a training run requires for "train" or "validation"."""
    return _level_sets(config, split) + _traffic_sets(config, split)


def _level_sets(config: TrainConfig, split: str) -> list[RecordingSet]:
    train = split == "train"
    first = config.first_seed if train else VALIDATION_SEED
    count = config.n_timesteps if train else config.eval_episodes
    sets = [RecordingSet(split, range(first, first + count), _level_recorder(config, split).record)]
    for kind in LEVEL_KINDS:
        texts: tuple[str, ...] = getattr(config, kind.option)
        option = f" --{kind.option.replace('_', '-')} {' '.join(texts)}"
        for number, text in enumerate(texts, 1):
            extra = parse_levels(text, kind.option)
            settings: Values = {"families": list(extra.names), **kind.arguments}
            changed = replace(config, env_kwargs=config.env_kwargs | settings)
            start = first + kind.stride * number
            seeds = range(start, start + (extra.count if train else -(-extra.count // EXTRA_RATIO)))
            record = _level_recorder(changed, split).record
            sets.append(RecordingSet(f"{kind.prefix}{number}-{split}", seeds, record, option, settings))
    return sets


def _traffic_sets(config: TrainConfig, split: str) -> list[RecordingSet]:
    sets: list[RecordingSet] = []
    if config.traffic_episodes:
        option = f" --traffic-episodes {config.traffic_episodes}"
        usual = ExtraEpisodes(config.traffic_episodes, tuple(TRAFFIC_KINDS))
        sets.append(_traffic_set(config, split, 0, usual, option))
    option = f" --extra-traffic {' '.join(config.extra_traffic)}"
    for number, text in enumerate(config.extra_traffic, 1):
        sets.append(_traffic_set(config, split, number, parse_traffic(text), option))
    return sets


def _traffic_set(
    config: TrainConfig, split: str, number: int, traffic: ExtraEpisodes, option: str
) -> RecordingSet:
    """Return the recordings of traffic episodes: the usual ones for number 0, else of some kinds."""
    train = split == "train"
    # The traffic suite of the benchmark uses the seeds from 0 on.
    first = SEED_STRIDE * (config.seed + 1) if train else VALIDATION_SEED
    first += SET_STRIDE * number
    seeds = range(first, first + (traffic.count if train else -(-traffic.count // TRAFFIC_RATIO)))
    params = config.env_kwargs.get("params")
    record = TrafficRecorder(split, config.camera, traffic.names, params).record
    name = f"extra-traffic{number}-{split}" if number else f"traffic-{split}"
    settings: Values = {"horizon_s": HORIZON} | ({"kinds": list(traffic.names)} if number else {})
    return RecordingSet(name, seeds, record, option, settings, CHUNK_SIZE)


def _level_recorder(config: TrainConfig, split: str) -> DriveRecorder:
    """Return the recorder of levels.

    Raises:
        ValueError: For an environment or a camera that the engine does not have.
    """
    top_view = any(isinstance(channel.camera, BirdsEye) for channel in make_channels(config.camera))
    if gym.spec(config.env_id).vector_entry_point is None or top_view:
        raise ValueError(
            f"algo {config.algo!r} requires a braking environment and no top view, got {config.env_id!r}"
        )
    return DriveRecorder(config.env_id, config.env_arguments(split))


def origin_of(config: TrainConfig) -> Values:
    """Return the settings that recorded episodes depend on, as plain values."""
    values = config.to_dict()
    origin: Values = {"format": FORMAT, "lgmd_gym": lgmd_gym.__version__}
    origin |= {name: values[name] for name in ("env_id", "env_kwargs", "camera", "demands")}
    return loads(dumps(origin | {"algo": config.algo}))  # lists in place of tuples


def load_or_record(
    config: TrainConfig, split: str, folder: Path, progress: bool = False, jobs: int = 1
) -> Iterator[DrivenEpisode]:
    """Return the episodes of a split: reused if `config.recordings` is set, else recorded in the folder.

    Missing episodes are recorded at once; the files are loaded one by one as the episodes are consumed.
    Complete files are kept, so that an interrupted recording resumes at the first missing or damaged one.
    """
    sets = recording_sets(config, split)
    if config.recordings is None:
        for recordings in sets:
            files = _folder_of(recordings, folder)
            _record_missing(recordings, files, origin_of(config) | recordings.settings, progress, jobs)
    training = config.recordings or folder
    return chain.from_iterable(_load(item, _folder_of(item, training)) for item in sets)


def _load(recordings: RecordingSet, files: Path) -> Iterator[DrivenEpisode]:
    """Yield the episodes of the seeds of a set, one file in memory at a time."""
    remaining = len(recordings.seeds)
    for file in sorted(files.glob("*.npz")):
        if remaining > 0:
            by_seed = load(file)[:remaining]
            remaining -= len(by_seed)
            yield from chain.from_iterable(by_seed)


def check_recordings(config: TrainConfig) -> None:
    """Check that a configuration can be recorded, or the recordings of another training run that it reuses.

    Raises:
        ValueError: If the engine has no such environment, there are no or too few recordings, or they were
            recorded with other settings.
    """
    _level_recorder(config, "train")  # raises an error for another environment
    if config.recordings is None:
        return
    for split in ("train", "validation"):
        for recordings in recording_sets(config, split):
            files = _folder_of(recordings, config.recordings)
            origin = origin_of(config) | recordings.settings
            stored = sorted(files.glob("*.npz"))
            for file in stored:
                if not is_complete(file):
                    raise ValueError(
                        f"{str(file)!r} is damaged; "
                        f"lgmd-gym train --resume {config.recordings} records it again"
                    )
            count = sum(check_file(file, origin, REUSED) for file in stored)
            if count == 0:
                raise ValueError(
                    f"no recorded episodes in {str(files)!r}; "
                    f"train once with --algo {config.algo}{recordings.option}, without --recordings"
                )
            if count < len(recordings.seeds):
                raise ValueError(
                    f"{str(files)!r} holds {count} episodes, {len(recordings.seeds)} are required; "
                    "reduce the number of episodes"
                )


def _folder_of(recordings: RecordingSet, training: str | Path) -> Path:
    return Path(training) / "episodes" / recordings.name


def _record_missing(recordings: RecordingSet, files: Path, origin: Values, progress: bool, jobs: int) -> None:
    from tqdm import tqdm

    files.mkdir(parents=True, exist_ok=True)
    seeds = recordings.seeds
    description = f"recording {recordings.name}"
    if progress:
        tqdm.write(f"{description}: {counted(len(seeds), 'episode')}")
    disabled = None if progress else True  # None: unless stderr is a terminal
    with tqdm(total=len(seeds), desc=description, unit="episode", disable=disabled) as bar:
        for start in range(0, len(seeds), FILE_SIZE):
            part, file = seeds[start : start + FILE_SIZE], files / f"{start:06d}.npz"
            if is_complete(file) and check_file(file, origin) == len(part):
                bar.update(len(part))
                continue
            by_seed: list[list[DrivenEpisode]] = []
            for episodes in record_parallel(recordings.record, part, jobs, recordings.chunk_size):
                by_seed.append(episodes)
                bar.update()
            save(by_seed, file, origin)
