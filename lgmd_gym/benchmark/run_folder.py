"""Run folders: created once, appended to as episodes finish, never overwritten."""

import json
import os
from errno import ENOSPC
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym._version import __version__
from lgmd_gym.benchmark.folder import provenance, replace_file
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.stored_run import ROWS_FILE, read_run, read_settings, rows_file
from lgmd_gym.processes.files import FolderLock, new_folder


class RunFolder:
    """Files of one run: `episodes.jsonl`, `run.json`, `run.toml`, `traces/` and the outputs.

    Use `create` for a new folder and `reopen` for an incomplete run. The folder is locked until `close`.

    Args:
        lock: Lock on the folder.
        path: Path of the folder.
        rows: Rows in the folder.
        repaired: Whether an incomplete last line was removed.
    """

    def __init__(self, lock: FolderLock, path: Path, rows: list[Row], repaired: bool = False) -> None:
        self.path, self.rows, self.repaired, self._lock = path, rows, repaired, lock
        # Unbuffered, so that closing does not retry a write that failed on a full disk.
        self._rows = (path / ROWS_FILE).open("ab", buffering=0)

    @classmethod
    def create(cls, path: Path) -> "RunFolder":
        """Create a run folder.

        Raises:
            ValueError: If it exists or cannot be created.
        """
        new_folder(path, "run folder")
        return cls(FolderLock(path), path, [])

    @classmethod
    def reopen(cls, path: Path) -> "RunFolder":
        """Open the folder of an incomplete run.

        An incomplete last line is removed, and so are error rows, whose episodes are run again.

        Raises:
            ValueError: If it contains no run, a damaged one, one of another version of this package, foreign
                or repeated rows, or if another process writes to it.
        """
        rows_file(path)
        lock = FolderLock(path)
        try:
            return cls._reopen(lock, path)
        except BaseException:
            lock.release()
            raise

    @classmethod
    def _reopen(cls, lock: FolderLock, path: Path) -> "RunFolder":
        made = read_settings(path).get("lgmd_gym")
        if made != __version__:
            raise ValueError(f"the run was made by lgmd-gym {made}, this is {__version__}; start a new run")
        stored = read_run(path)
        played = [row for row in stored.rows if row["error"] is None]
        if stored.truncated or len(played) < len(stored.rows):
            text = "".join(json.dumps(row, allow_nan=False) + "\n" for row in played)
            replace_file(path / ROWS_FILE, text)
        return cls(lock, path, played, stored.truncated)

    def add(self, row: Row) -> None:
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
        replace_file(self.path / "run.json", json.dumps(settings | provenance(), indent=2) + "\n")

    def close(self) -> None:
        """Close the open file and release the lock."""
        self._rows.close()
        self._lock.release()
