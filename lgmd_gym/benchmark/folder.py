"""Folders of results: files that are replaced as a whole, and the origin of a run."""

import os
import platform
import subprocess
import time
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from lgmd_gym._version import __version__
from lgmd_gym.processes.files import complete_file

PACKAGES = ("numpy", "numba", "gymnasium", "highway-env", "joblib")


def replace_file(file: Path, text: str) -> None:
    """Write a file atomically: an interruption leaves either the old or the new contents."""
    with complete_file(file) as part:
        part.write_text(text, encoding="utf-8")


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


@cache
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
