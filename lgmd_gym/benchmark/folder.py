"""A run folder: made once, written to as episodes finish, never overwritten."""

import json
import os
import platform
import subprocess
import time
from errno import ENOSPC
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym._version import __version__
from lgmd_gym.benchmark.new_folder import new_folder

PACKAGES = ("numpy", "numba", "gymnasium", "highway-env", "joblib")


class RunFolder:
    """The files of one run: `episodes.jsonl`, `run.json`, `run.toml`, `traces/`, and what reports add.

    Use `create` for a new one and `reopen` for one that was broken off.

    Attributes:
        path: Where it is.
        rows: The rows it held when it was opened.
        mended: Whether a last line that had been cut off was taken away.
    """

    def __init__(self, path: Path, rows: list[dict[str, Any]], mended: bool = False) -> None:
        self.path, self.rows, self.mended = path, rows, mended
        # Unbuffered: what a full disk refuses must not be tried again at closing.
        self._rows = (path / "episodes.jsonl").open("ab", buffering=0)

    @classmethod
    def create(cls, path: Path) -> "RunFolder":
        """Make a new folder.

        Raises:
            ValueError: If it exists or cannot be made.
        """
        new_folder(path, "run folder")
        return cls(path, [])

    @classmethod
    def reopen(cls, path: Path) -> "RunFolder":
        """Open the folder of a broken-off run.

        A cut-off last line goes, and so do the rows of episodes that failed, which will be played again.

        Raises:
            ValueError: If it holds no run, or a damaged one.
        """
        rows, mended = read_rows(path)
        played = [row for row in rows if row["error"] is None]
        if mended or len(played) < len(rows):
            text = "".join(json.dumps(row, allow_nan=False) + "\n" for row in played)
            _replace(path / "episodes.jsonl", text)
        return cls(path, played, mended)

    def settings(self) -> dict[str, Any]:
        """Return what `run.json` says.

        Raises:
            ValueError: If it is missing, damaged, or from another version of this package.
        """
        settings = read_settings(self.path)
        made = settings.get("lgmd_gym")
        if made != __version__:
            raise ValueError(f"the run was made by lgmd-gym {made}, this is {__version__}; start a new run")
        return settings

    def add(self, row: dict[str, Any]) -> None:
        """Append one row and have it on disk before the next.

        Raises:
            OSError: If the disk is full; the rows before stay whole.
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
        """Keep one episode's time series as `traces/<name>.npz`."""
        folder = self.path / "traces"
        folder.mkdir(exist_ok=True)
        np.savez_compressed(folder / f"{name}.npz", allow_pickle=False, **series)

    def series(self, name: str) -> dict[str, np.ndarray] | None:
        """Return the time series kept under a name, None for none."""
        return read_series(self.path, name)

    def describe(self, settings: dict[str, Any]) -> None:
        """Write `run.json`: the settings, and the machine and versions they ran on."""
        _replace(self.path / "run.json", json.dumps(settings | provenance(), indent=2) + "\n")

    def close(self) -> None:
        """Close the open file."""
        self._rows.close()


def read_rows(path: Path) -> tuple[list[dict[str, Any]], bool]:
    """Return the rows of a run folder, and whether a cut-off last line was left out.

    Raises:
        ValueError: If the folder holds no run, or a damaged one.
    """
    file = path / "episodes.jsonl"
    if not file.is_file():
        raise ValueError(f"{str(path)!r} holds no run (no episodes.jsonl); start one with --out")
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
    """Return what `run.json` of a run folder says.

    Raises:
        ValueError: If it is missing or damaged.
    """
    file = path / "run.json"
    try:
        return json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise ValueError(f"{str(file)!r} is missing or damaged; start a new run") from None


def read_series(path: Path, name: str) -> dict[str, np.ndarray] | None:
    """Return the time series that a run folder keeps under a name, None for none."""
    file = path / "traces" / f"{name}.npz"
    if not file.exists():
        return None
    with np.load(file) as series:
        return dict(series)


def _replace(file: Path, text: str) -> None:
    """Write a file in one go: whatever breaks off the writing, the old or the new one is there, whole."""
    fresh = file.with_name(f"{file.name}.new")
    fresh.write_text(text, encoding="utf-8")
    fresh.replace(file)


def provenance() -> dict[str, Any]:
    """Return versions, commit, processor and date of this run."""
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
    """Return the commit of the source tree this package is imported from; None if it is installed."""
    if not (Path(__file__).parents[2] / "pyproject.toml").is_file():
        return None
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty"],
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            timeout=10,
            check=True,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip() or None


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
