"""Run folders: created once, appended to as episodes finish, never overwritten."""

import json
import os
import platform
import subprocess
import time
from errno import ENOSPC
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym._version import __version__

if TYPE_CHECKING:
    from lgmd_gym.benchmark.rows import Row

PACKAGES = ("numpy", "numba", "gymnasium", "highway-env", "joblib")


class RunFolder:
    """Files of one run: `episodes.jsonl`, `run.json`, `run.toml`, `traces/` and the outputs.

    Use `create` for a new folder and `reopen` for an incomplete run.

    Attributes:
        path: Path of the folder.
        rows: Rows present when the folder was opened.
        repaired: Whether an incomplete last line was removed.
    """

    def __init__(self, path: Path, rows: "list[Row]", repaired: bool = False) -> None:
        self.path, self.rows, self.repaired = path, rows, repaired
        # Unbuffered, so that closing does not retry a write that failed on a full disk.
        self._rows = (path / "episodes.jsonl").open("ab", buffering=0)

    @classmethod
    def create(cls, path: Path) -> "RunFolder":
        """Create a run folder.

        Raises:
            ValueError: If it exists or cannot be created.
        """
        return cls(new_folder(path, "run folder"), [])

    @classmethod
    def reopen(cls, path: Path) -> "RunFolder":
        """Open the folder of an incomplete run.

        An incomplete last line is removed, and so are error rows, whose episodes are run again.

        Raises:
            ValueError: If it contains no run, a damaged one, or one of another version of this package.
        """
        rows, repaired = read_rows(path)
        made = read_settings(path).get("lgmd_gym")
        if made != __version__:
            raise ValueError(f"the run was made by lgmd-gym {made}, this is {__version__}; start a new run")
        played = [row for row in rows if row["error"] is None]
        if repaired or len(played) < len(rows):
            text = "".join(json.dumps(row, allow_nan=False) + "\n" for row in played)
            _replace(path / "episodes.jsonl", text)
        return cls(path, played, repaired)

    def add(self, row: "Row") -> None:
        """Append one row and write it to disk.

        Raises:
            OSError: If the disk is full; earlier rows stay intact.
        """
        line = (json.dumps(row, allow_nan=False) + "\n").encode()
        before = self._rows.tell()
        try:
            if self._rows.write(line) != len(line):
                raise OSError(ENOSPC, os.strerror(ENOSPC))
        except OSError:
            self._rows.truncate(before)
            raise

    def add_series(self, name: str, series: dict[str, np.ndarray]) -> None:
        """Write the time series of one episode to `traces/<name>.npz`."""
        folder = self.path / "traces"
        folder.mkdir(exist_ok=True)
        np.savez_compressed(folder / f"{name}.npz", allow_pickle=False, **series)

    def describe(self, settings: dict[str, Any]) -> None:
        """Write `run.json`: the settings, the machine and the versions."""
        _replace(self.path / "run.json", json.dumps(settings | provenance(), indent=2) + "\n")

    def close(self) -> None:
        """Close the open file."""
        self._rows.close()


def new_folder(path: Path, kind: str) -> Path:
    """Create a folder with its parents and return its path.

    Args:
        path: Folder to create.
        kind: Kind of folder, for the message ("run folder", ...).

    Raises:
        ValueError: If it exists or cannot be created.
    """
    try:
        path.mkdir(parents=True, exist_ok=False)
    except FileExistsError:
        raise ValueError(f"{kind} {str(path)!r} already exists; choose another --out") from None
    except OSError as error:
        raise ValueError(
            f"{kind} {str(path)!r} cannot be created ({error.strerror}); choose another --out"
        ) from None
    return path


def read_rows(path: Path) -> "tuple[list[Row], bool]":
    """Return the rows of a run folder, and whether an incomplete last line was skipped.

    Raises:
        ValueError: If the folder contains no run or a damaged one.
    """
    file = path / "episodes.jsonl"
    if not file.is_file():
        raise ValueError(f"{str(path)!r} contains no run (no episodes.jsonl); start one with --out")
    rows = []
    lines = file.read_bytes().splitlines(keepends=True)
    for number, line in enumerate(lines):
        try:
            if not line.endswith(b"\n"):
                raise ValueError
            rows.append(json.loads(line))
        except ValueError:
            if number < len(lines) - 1:
                raise ValueError(f"{str(file)!r} is damaged in line {number + 1}; start a new run") from None
            return rows, True
    return rows, False


def read_settings(path: Path) -> dict[str, Any]:
    """Return the contents of `run.json` of a run folder.

    Raises:
        ValueError: If it is missing or damaged.
    """
    file = path / "run.json"
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise ValueError(f"{str(file)!r} is missing or damaged; start a new run") from None


def read_series(path: Path, name: str) -> dict[str, np.ndarray] | None:
    """Return the time series in `traces/<name>.npz` of a run folder, or None if there is no such file."""
    file = path / "traces" / f"{name}.npz"
    if not file.exists():
        return None
    with np.load(file) as series:
        return dict(series)


def _replace(file: Path, text: str) -> None:
    """Write a file atomically: an interruption leaves either the old or the new contents."""
    fresh = file.with_name(f"{file.name}.new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(file)


def provenance() -> dict[str, Any]:
    """Return the versions, commit, processor and date of this run."""
    return {
        "lgmd_gym": __version__,
        "commit": _commit(),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "processor": _processor(),
        "cpus": os.cpu_count(),
        "finished": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
    }


def _commit() -> str | None:
    """Return the commit of the source tree that holds this package; None for an installed package."""
    if not (Path(__file__).parents[2] / "pyproject.toml").is_file():
        return None
    try:
        described = subprocess.run(
            ["git", "describe", "--always", "--dirty"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return described.stdout.strip() or None


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
