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

    Use `create` for a new one and `reopen` for one that was broken off.

    Attributes:
        path: Where it is.
        rows: The rows it held when it was opened.
        mended: Whether a last line that had been cut off was taken away.
    """

    def __init__(self, path: Path, rows: list[dict[str, Any]], mended: bool = False) -> None:
        self.path, self.rows, self.mended = path, rows, mended
        self._rows = (path / "episodes.jsonl").open("a", encoding="utf-8")

    @classmethod
    def create(cls, path: Path) -> "RunFolder":
        """Make a new folder.

        Raises:
            ValueError: If it exists or cannot be made.
        """
        try:
            path.mkdir(parents=True, exist_ok=False)
        except FileExistsError:
            raise ValueError(f"run folder {str(path)!r} exists and is kept; choose another --out") from None
        except OSError as error:
            raise ValueError(
                f"run folder {str(path)!r} cannot be made ({error.strerror}); choose another --out"
            ) from None
        return cls(path, [])

    @classmethod
    def reopen(cls, path: Path) -> "RunFolder":
        """Open the folder of a broken-off run; a cut-off last line goes, all others stay.

        Raises:
            ValueError: If it holds no run, or a damaged one.
        """
        file = path / "episodes.jsonl"
        if not file.is_file():
            raise ValueError(
                f"{str(path)!r} holds no run to resume (no episodes.jsonl); start one with --out"
            )
        rows, good = [], 0
        lines = file.read_bytes().splitlines(keepends=True)
        for number, line in enumerate(lines):
            try:
                if not line.endswith(b"\n"):
                    raise ValueError
                rows.append(json.loads(line))
            except ValueError:
                if number < len(lines) - 1:
                    raise ValueError(
                        f"{str(file)!r} is damaged in line {number + 1}; start a new run"
                    ) from None
                break
            good += len(line)
        mended = good < file.stat().st_size
        if mended:
            os.truncate(file, good)
        return cls(path, rows, mended)

    def settings(self) -> dict[str, Any]:
        """Return what `run.json` says.

        Raises:
            ValueError: If it is missing, damaged, or from another version of this package.
        """
        file = self.path / "run.json"
        try:
            settings = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            raise ValueError(f"{str(file)!r} is missing or damaged; start a new run") from None
        if settings.get("lgmd_gym") != __version__:
            made = settings.get("lgmd_gym")
            raise ValueError(f"the run was made by lgmd-gym {made}, this is {__version__}; start a new run")
        return settings

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
