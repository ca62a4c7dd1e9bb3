"""Failed episodes in a few lines: which agent failed, with which exception, and where in its code."""

import re
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import lgmd_gym
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.errors import counted

MAX_FAILURES = 5  # kinds of failure that are described
EARLY = 8  # an agent whose first episodes all fail ends the run after this number

_PACKAGE = str(Path(lgmd_gym.__file__).parent)
_FRAME = re.compile(r'^  File "(.+)", line (\d+), in (.+)$', re.MULTILINE)


def failure_lines(rows: Iterable[Row]) -> list[str]:
    """Return a line for each agent and exception: the number of episodes, the exception and its place.

    Args:
        rows: Rows of a run; those without error are skipped.
    """
    failed = [row for row in rows if row["error"] is not None]
    kinds = Counter((row["agent"], describe_failure(row["error"])) for row in failed)
    most = kinds.most_common(MAX_FAILURES)
    lines = [f"{agent}: {text} ({counted(count, 'episode')})" for (agent, text), count in most]
    if len(kinds) > MAX_FAILURES:
        lines.append(f"{len(kinds) - MAX_FAILURES} other failures")
    return lines


def failing_agent(rows: Iterable[Row]) -> str:
    """Return the first agent with at least `EARLY` rows, all of them failed; "" if there is none."""
    failed, succeeded = Counter(), set()
    for row in rows:
        if row["error"] is None:
            succeeded.add(row["agent"])
        else:
            failed[row["agent"]] += 1
    return next((agent for agent, n in failed.items() if n >= EARLY and agent not in succeeded), "")


def describe_failure(error: str) -> str:
    """Return the exception of a traceback and its place in code outside this package."""
    exception = error.strip().splitlines()[-1].strip()
    frames = _FRAME.findall(error)
    own = [frame for frame in frames if not frame[0].startswith(_PACKAGE) and "site-packages" not in frame[0]]
    place = ""
    if frames:
        file, line, function = (own or frames)[-1]
        place = f" at {_short(file)}:{line} in {function}"
    return f"{exception}{place}"


def _short(file: str) -> str:
    """Return a path relative to the working directory, if it is in it."""
    path = Path(file)
    return str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else file
