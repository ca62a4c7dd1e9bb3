"""Recorded drives in files, each with what they were recorded by."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

import lgmd_gym
from lgmd_gym.agents.policies.features import FRAME
from lgmd_gym.training.config import Plan
from lgmd_gym.training.offline.episodes import Drive

TOLD = ("rewards", "returns", "contacts")
FORMAT = 3  # drives by the seed that they come from; one drive's arrays are all of one length


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


def save(by_seed: list[list[Drive]], file: Path, origin: dict[str, Any]) -> None:
    """Write drives, and what they were recorded by, into a file that is there whole or not at all.

    Args:
        by_seed: The drives that come from each seed; a drive through traffic gives any number of pieces.
        file: To be written.
        origin: See `origin_of`.
    """
    drives = [drive for some in by_seed for drive in some]
    arrays: dict[str, Any] = {
        "origin": np.array(json.dumps(origin)),
        "counts": np.array([len(some) for some in by_seed]),
        "lengths": np.array([len(drive) for drive in drives]),
        "threats": np.array([drive.threat for drive in drives]),
    }
    arrays |= _joined(drives) if drives else {}
    unfinished = file.with_suffix(".part")
    with unfinished.open("wb") as out:
        np.savez_compressed(out, **arrays)
    unfinished.rename(file)


def _joined(drives: list[Drive]) -> dict[str, np.ndarray]:
    joined = {name: np.concatenate([getattr(drive, name) for drive in drives]) for name in TOLD}
    if drives[0].frames is not None:
        joined["frames"] = np.concatenate([drive.frames for drive in drives if drive.frames is not None])
    for name in drives[0].seen:
        joined[f"seen/{name}"] = np.concatenate([drive.seen[name] for drive in drives])
    return joined


def load(file: Path) -> tuple[list[list[Drive]], dict[str, Any]]:
    """Return the drives in a file, by seed, and what they were recorded by.

    Raises:
        ValueError: If it holds none.
    """
    with _opened(file) as kept:
        drives = _cut(kept)
        return [[next(drives) for _ in range(count)] for count in kept["counts"]], _origin(kept)


def check_file(file: Path, origin: dict[str, Any]) -> int:
    """Return how many seeds a file has the drives of; reads no drives.

    Raises:
        ValueError: If it holds none, or they were recorded with another eye or environment than `origin`.
    """
    with _opened(file) as kept:
        _check_same(_origin(kept), origin, file)
        return len(kept["counts"])


def _origin(kept: Any) -> dict[str, Any]:
    return json.loads(str(kept["origin"]))


def _opened(file: Path) -> Any:
    try:
        kept = np.load(file)
        if "origin" not in kept:
            raise ValueError("no origin in it")
    except (OSError, ValueError, BadZipFile) as error:
        raise ValueError(f"{str(file)!r} holds no recorded drives ({error})") from None
    return kept


def _cut(kept: Any) -> Iterator[Drive]:
    arrays = {name: kept[name] for name in kept.files if name not in ("origin", "counts")}
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
