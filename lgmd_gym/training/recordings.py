"""Recorded drives in files: one training records them, others learn from the same."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

import lgmd_gym
from lgmd_gym.agents.features import FRAME
from lgmd_gym.training.drives import Drive, record
from lgmd_gym.training.orders import JUDGED, SEEDS_APART, Plan

PART = 100  # drives in one file
TOLD = ("rewards", "returns", "contacts")
FORMAT = 2  # one drive's arrays are all of one length: the environment's decisions


def drives_of(plan: Plan, split: str, folder: Path, progress: bool, jobs: int) -> list[Drive]:
    """Return the drives of a training: of another's folder if the plan says so, else its own.

    Its own are recorded once and kept in its folder, a hundred in a file, so that an interrupted recording
    goes on from there.

    Args:
        plan: Of the training.
        split: "train" or "validation".
        folder: Of the training.
        progress: Whether to show it on stderr.
        jobs: Processes that record.
    """
    wanted = _wanted(plan, split)
    kept = Path(plan.drives or folder) / "drives" / split
    if plan.drives is None:
        _record_missing(plan, split, kept, progress, jobs)
    drives: list[Drive] = []
    for file in sorted(kept.glob("*.npz")):
        if len(drives) < wanted:
            drives += load(file)[0]
    return drives[:wanted]


def check_drives(plan: Plan) -> None:
    """Refuse another training's drives that will not do, before anything is done.

    Raises:
        ValueError: If they are none, too few, or were recorded with another eye or environment.
    """
    for split in ("train", "validation") if plan.drives is not None else ():
        kept, count = Path(plan.drives or "") / "drives" / split, 0
        for file in sorted(kept.glob("*.npz")):
            with _opened(file) as some:  # reads these two arrays and no drives
                _check_same(json.loads(str(some["origin"])), origin_of(plan), file)
                count += len(some["lengths"])
        if count == 0:
            raise ValueError(f"no recorded drives in {str(kept)!r}; train once with --algo recorded")
        if count < _wanted(plan, split):
            raise ValueError(
                f"{str(kept)!r} holds {count} drives, {_wanted(plan, split)} are wanted; ask for fewer"
            )


def _wanted(plan: Plan, split: str) -> int:
    return plan.n_timesteps if split == "train" else plan.eval_episodes


def _record_missing(plan: Plan, split: str, kept: Path, progress: bool, jobs: int) -> None:
    from tqdm import tqdm

    kept.mkdir(parents=True, exist_ok=True)
    wanted = _wanted(plan, split)
    first = SEEDS_APART * plan.seed if split == "train" else JUDGED
    with tqdm(total=wanted, desc=f"recording {split}", unit="drive", disable=not progress) as bar:
        for start in range(0, wanted, PART):
            seeds = range(first + start, first + min(start + PART, wanted))
            file = kept / f"{start:06d}.npz"
            if file.exists():
                bar.update(len(seeds))
            else:
                save(record(plan, split, seeds, jobs, bar.update), file, origin_of(plan))


def origin_of(plan: Plan) -> dict[str, Any]:
    """Return what drives depend on, as plain values; frames only if they are part of them."""
    framed = FRAME in plan.features["inputs"]
    origin = {
        "format": FORMAT,
        "env_id": plan.env_id,
        "env_kwargs": plan.env_kwargs,
        "camera": plan.camera,
        "demands": plan.demands,
        "shrink": plan.features["shrink"] if framed else None,
        "lgmd_gym": lgmd_gym.__version__,
    }
    return json.loads(json.dumps(origin))


def _check_same(theirs: dict[str, Any], ours: dict[str, Any], file: Path) -> None:
    for key, value in ours.items():
        if theirs.get(key) != value and not (key == "shrink" and value is None):
            raise ValueError(
                f"the drives in {str(file)!r} were recorded with another {key} "
                f"({_short(theirs.get(key))}, not {_short(value)}); record anew, without --drives"
            )


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def save(drives: list[Drive], file: Path, origin: dict[str, Any]) -> None:
    """Write drives, and what they were recorded by, into a file that is there whole or not at all."""
    arrays: dict[str, Any] = {
        "origin": np.array(json.dumps(origin)),
        "lengths": np.array([len(drive) for drive in drives]),
        "threats": np.array([drive.threat for drive in drives]),
    }
    for name in TOLD:
        arrays[name] = np.concatenate([getattr(drive, name) for drive in drives])
    if drives[0].frames is not None:
        arrays["frames"] = np.concatenate([drive.frames for drive in drives if drive.frames is not None])
    for name in drives[0].seen:
        arrays[f"seen/{name}"] = np.concatenate([drive.seen[name] for drive in drives])
    unfinished = file.with_suffix(".part")
    with unfinished.open("wb") as out:
        np.savez_compressed(out, **arrays)
    unfinished.rename(file)


def load(file: Path) -> tuple[list[Drive], dict[str, Any]]:
    """Return the drives in a file and what they were recorded by.

    Raises:
        ValueError: If it holds none.
    """
    with _opened(file) as kept:
        return list(_cut(kept)), json.loads(str(kept["origin"]))


def _opened(file: Path) -> Any:
    try:
        kept = np.load(file)
        if "origin" not in kept:
            raise ValueError("no origin in it")
    except (OSError, ValueError, BadZipFile) as error:
        raise ValueError(f"{str(file)!r} holds no recorded drives ({error})") from None
    return kept


def _cut(kept: Any) -> Iterator[Drive]:
    arrays = {name: kept[name] for name in kept.files if name != "origin"}
    seen = {name.removeprefix("seen/"): array for name, array in arrays.items() if name.startswith("seen/")}
    frames = arrays.get("frames")
    ends = np.cumsum([0, *arrays["lengths"]])
    for index, threat in enumerate(arrays["threats"]):
        lived = slice(*ends[index : index + 2])
        rewards, returns, contacts = (arrays[name][lived] for name in TOLD)
        yield Drive(
            {name: array[lived] for name, array in seen.items()},
            None if frames is None else frames[lived],
            rewards,
            returns,
            contacts,
            bool(threat),
        )
