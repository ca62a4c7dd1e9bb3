"""A run folder: made once, written to as episodes finish, never overwritten."""

import json
import os
import platform
import subprocess
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym._version import __version__

PACKAGES = ("numpy", "numba", "gymnasium", "highway-env", "joblib")


class RunFolder:
    """The files of one run: `episodes.jsonl`, `run.json`, `traces/`, and what reports add.

    Args:
        path: A folder that does not exist yet.

    Raises:
        ValueError: If it exists or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        try:
            path.mkdir(parents=True, exist_ok=False)
        except FileExistsError:
            raise ValueError(f"run folder {str(path)!r} exists and is kept; choose another --out") from None
        except OSError as error:
            raise ValueError(
                f"run folder {str(path)!r} cannot be made ({error.strerror}); choose another --out"
            ) from None
        self.path = path
        self._rows = (path / "episodes.jsonl").open("a", encoding="utf-8")

    def add(self, row: dict[str, Any]) -> None:
        """Append one row and have it on disk before the next."""
        self._rows.write(json.dumps(row, allow_nan=False) + "\n")
        self._rows.flush()

    def add_series(self, name: str, series: dict[str, np.ndarray]) -> None:
        """Keep one episode's time series as `traces/<name>.npz`."""
        folder = self.path / "traces"
        folder.mkdir(exist_ok=True)
        np.savez_compressed(folder / f"{name}.npz", allow_pickle=False, **series)

    def describe(self, settings: dict[str, Any]) -> None:
        """Write `run.json`: the settings, and the machine and versions they ran on."""
        text = json.dumps(settings | provenance(), indent=2)
        (self.path / "run.json").write_text(text + "\n", encoding="utf-8")

    def close(self) -> None:
        """Close the open file."""
        self._rows.close()


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
