"""Run folders: created once, appended to as episodes finish, never overwritten; read and checked."""

import json
import re
import shutil
from hashlib import blake2b
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from lgmd_gym._version import __version__
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import ID_KEYS, Row, RowKey, is_traffic, key_of
from lgmd_gym.benchmark.config import RUN_FILE, RunConfig, provenance
from lgmd_gym.camera import CLEAR
from lgmd_gym.processes.files import FolderLock, new_folder, replace_file
from lgmd_gym.processes.inputs import read_bytes, read_json

_MAX_BYTES = 220  # file systems allow 255 with the suffix
# These texts stay distinct with "_" for their separators: a case with slashes, and an agent with options.
_CASE = re.compile(r"[^_:,]+")
_AGENT = re.compile(r"[^_/:,]+(:[^_/:,]+(,[^_/:,]+)*)?")


def series_name(key: tuple[str, str, int, str]) -> str:
    """Return the file stem of the time series of a row, given its `key_of`; different for every key."""
    agent, case, seed, condition = key
    usual = _CASE.fullmatch(case) and _AGENT.fullmatch(agent)
    return _stem((case, agent, f"seed{seed}", condition), bool(usual))


def case_name(case: str, condition: str) -> str:
    """Return the file stem of the plot of a case under a condition; different for every pair."""
    return _stem((case, condition), bool(_CASE.fullmatch(case)))


def _stem(parts: tuple[str, ...], usual: bool) -> str:
    """Return the parts as a file name; a digest distinguishes names that are unusual or too long."""
    shown = parts[:-1] if parts[-1] == CLEAR else parts
    stem = re.sub("[/:,]", "_", "__".join(shown))
    encoded = stem.encode(errors="surrogateescape")
    if usual and len(encoded) <= _MAX_BYTES:
        return stem
    digest = blake2b(json.dumps(parts).encode(), digest_size=6).hexdigest()
    return f"{encoded[:_MAX_BYTES].decode(errors='ignore')}-{digest}"


ROWS_FILE = "episodes.jsonl"
MAX_LISTED = 10  # line numbers that a message lists


class StoredRun(NamedTuple):
    """Contents of a run folder."""

    config: RunConfig  # configuration of the run
    rows: list[Row]  # rows in the order of the file; each belongs to the run, and none occurs twice
    truncated: bool  # whether an incomplete last line was skipped


def read_run(path: Path) -> StoredRun:
    """Read and check the configuration and the rows of a run folder.

    Raises:
        ValueError: If the folder contains no run or a damaged one, a row of another run, or an episode twice.
    """
    file = rows_file(path)
    rows, truncated = _parse(file)
    config = RunConfig.load(path / RUN_FILE)
    _check_rows(file, rows, config)
    return StoredRun(config, rows, truncated)


def read_case_rows(path: Path) -> list[Row]:
    """Return the rows of a run folder; raise ValueError for a traffic run."""
    run = read_run(path)
    if is_traffic(run.config.suite):
        raise ValueError(f"{str(path)!r} is a traffic run; its summary.csv holds the rates per 100 km")
    return run.rows


def rows_file(path: Path) -> Path:
    """Return the path of `episodes.jsonl` in a run folder.

    Raises:
        ValueError: If there is no such file.
    """
    file = path / ROWS_FILE
    if not file.is_file():
        raise ValueError(f"{str(path)!r} contains no run (no {ROWS_FILE}); start one with --out")
    return file


def read_settings(path: Path) -> Values:
    """Return the contents of `run.json` of a run folder.

    Raises:
        ValueError: If it is missing or damaged.
    """
    file = path / "run.json"
    try:
        settings: object = read_json(file)
        if not isinstance(settings, dict):
            raise ValueError
    except (OSError, ValueError):
        raise ValueError(f"{str(file)!r} is missing or damaged; start a new run") from None
    return cast(Values, settings)


def read_series(path: Path, name: str) -> dict[str, np.ndarray] | None:
    """Return the time series in `traces/<name>.npz` of a run folder, or None if there is no such file.

    Raises:
        ValueError: If the file is damaged.
    """
    file = path / "traces" / f"{name}.npz"
    if not file.exists():
        return None
    try:
        with np.load(file) as series:
            return dict(series)
    except Exception:  # errors of the archive, its compression or its arrays, or of the file system
        raise ValueError(f"{str(file)!r} is damaged; remove it to leave its episode out") from None


def _parse(file: Path) -> tuple[list[Row], bool]:
    """Return the rows of a file, and whether an incomplete last line was skipped."""
    rows: list[Row] = []
    lines = read_bytes(file, None).splitlines(keepends=True)
    for number, line in enumerate(lines, start=1):
        try:
            if not line.endswith(b"\n"):
                raise ValueError
            rows.append(json.loads(line))
        except ValueError:
            if number < len(lines):
                raise _damaged(file, number) from None
            return rows, True
    return rows, False


def _damaged(file: Path, number: int) -> ValueError:
    return ValueError(f"{str(file)!r} is damaged in line {number}; start a new run")


def _check_rows(file: Path, rows: list[Row], config: RunConfig) -> None:
    """Raise ValueError for rows without an identity, rows of another run, and repeated rows."""
    suite = config.get_suite()
    planned, lines, faults = config.row_keys(suite), dict[RowKey, int](), dict[int, str]()
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, dict) or not {*ID_KEYS, "error"} <= row.keys():  # pyright: ignore[reportUnnecessaryIsInstance]
            raise _damaged(file, number)
        key = key_of(row)
        try:
            is_planned = key in planned
        except TypeError:  # a list or table in the place of a name
            raise _damaged(file, number) from None
        if row["suite"] != suite.name or not is_planned:
            faults[number] = f"does not belong to the run: {', '.join(map(str, key))}"
        elif row.keys() != rows[0].keys():
            faults[number] = "has other columns than line 1, as from another version"
        elif key in lines:
            faults[number] = f"repeats the episode of line {lines[key]}"
        lines.setdefault(key, number)
    if faults:
        number, fault = next(iter(faults.items()))
        others = [str(other) for other in faults if other != number]
        listed = ", ".join(others[:MAX_LISTED]) + (", ..." if len(others) > MAX_LISTED else "")
        more = f" (also to be checked: {len(others)} lines, {listed})" if others else ""
        raise ValueError(f"{str(file)!r} line {number} {fault}{more}; remove such lines or start a new run")


class RunFolder:
    """Files of one run: `episodes.jsonl`, `run.json`, `run.toml`, `traces/` and the outputs.

    Use `create` for a new folder and `reopen` for an incomplete run. The folder is locked until `close`.
    `repaired` states whether an incomplete last line was removed.
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
        try:
            return cls(FolderLock(path), path, [])
        except BaseException:
            shutil.rmtree(path, ignore_errors=True)
            raise

    def discard(self) -> None:
        """Close and remove a new folder whose run cannot start, so that the same command can be repeated."""
        self.close()
        shutil.rmtree(self.path, ignore_errors=True)

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
            OSError: If the disk is full or the file too large; earlier rows stay intact.
        """
        line = (json.dumps(row, allow_nan=False) + "\n").encode()
        before = self._rows.tell()
        try:
            while line:  # after a part, the next write states the reason, a full disk or a limit of size
                line = line[self._rows.write(line) :]
        except OSError:
            self._rows.truncate(before)
            raise

    def add_series(self, name: str, series: dict[str, np.ndarray]) -> None:
        """Write the time series of one episode to `traces/<name>.npz`."""
        folder = self.path / "traces"
        folder.mkdir(exist_ok=True)
        np.savez_compressed(folder / f"{name}.npz", allow_pickle=False, **series)

    def describe(self, settings: Values) -> None:
        """Write `run.json`: the settings, the machine and the versions."""
        replace_file(self.path / "run.json", json.dumps(settings | provenance(), indent=2) + "\n")

    def close(self) -> None:
        """Close the open file and release the lock."""
        self._rows.close()
        self._lock.release()
