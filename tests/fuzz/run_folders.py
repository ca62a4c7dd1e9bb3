"""Damaged run folders: `python tests/fuzz/run_folders.py --seconds 120`.

A case is a small run, complete or interrupted, with one file deleted, cut off, changed or replaced.
`compare`, `bench --resume` and the report must succeed or end with one line.
"""

import contextlib
import io
import json
import shutil
import sys
import tempfile
from functools import cache
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from support.fuzz import run_cases
from support.runs import SMALL_SUITE, interrupt, new_run

from lgmd_gym.cli import main as cli
from lgmd_gym.report.page import write_outputs

VALUES = ("null", "true", "-1", "1e400", '""', '"x"', "[]", "{}", "nan")


@cache
def runs():
    """Return a complete and an interrupted run."""
    base = Path(tempfile.mkdtemp())
    (base / "small.toml").write_text(SMALL_SUITE)
    values = {"suite": str(base / "small.toml"), "agents": ["spike-threshold"], "seeds": 1}
    new_run(base / "complete", **values).play()
    new_run(base / "interrupted", **values).play(interrupt)
    return base / "complete", base / "interrupted"


def damage(rng, folder):
    """Damage one file, and return what was done."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    file = files[rng.integers(len(files))]
    data, kind = bytearray(file.read_bytes()), rng.integers(5)
    if kind == 0:
        file.unlink()
    elif kind == 1:
        file.write_bytes(data[: rng.integers(len(data) + 1)])
    elif kind == 2:
        for place in rng.integers(len(data), size=rng.integers(1, 20)) if data else ():
            data[place] = rng.integers(256)
        file.write_bytes(data)
    elif kind == 3:
        file.unlink()
        file.mkdir()
    elif file.suffix == ".jsonl":
        lines = file.read_text().splitlines()
        row = json.loads(lines[rng.integers(len(lines))]) if lines else {}
        text = json.dumps(row)
        for key in rng.permutation(list(row))[:1]:
            value = json.dumps(row[key])
            text = text.replace(f'"{key}": {value}', f'"{key}": {VALUES[rng.integers(len(VALUES))]}')
        file.write_text("\n".join([*lines[1:], text]) + "\n")
    else:
        file.write_bytes(data + b"nonsense")
    return f"{file.relative_to(folder)}, kind {kind}"


def end_of(arguments):
    """Return the exit code of a command and its lines on stderr."""
    stdout, stderr = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
        code = cli.run(arguments)
    return code, [line for line in stderr.getvalue().splitlines() if "━" not in line]  # no progress bar


def draw_case(rng):
    """Return a description and the check of one damaged folder."""
    base = Path(tempfile.mkdtemp())
    folder = base / "run"
    shutil.copytree(runs()[rng.integers(2)], folder)
    done = damage(rng, folder)

    def check():
        try:
            for command in (["compare", str(folder)], ["bench", "--resume", str(folder), "--jobs", "1"]):
                code, lines = end_of(
                    [*command, *(["--no-plots", "--no-report"] if "bench" in command else [])]
                )
                assert code in (0, 2), (command[0], code, lines)
                assert code == 0 or len(lines) == 1, (command[0], code, lines)
            try:
                write_outputs(folder)
            except (ValueError, OSError) as error:
                assert "\n" not in str(error), str(error)  # noqa: PT017
        finally:
            shutil.rmtree(base)

    return done, check


if __name__ == "__main__":
    sys.exit(run_cases(draw_case, __doc__))
