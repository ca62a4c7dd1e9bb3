"""Arms over the same episodes: several trainings of one kind of policy, or a rule, which is an arm of one.

The mean return of an arm is the interquartile mean over its trainings; not over episodes, whose worst quarter
is the contacts. Intervals come from a stratified bootstrap that draws trainings and, among threats and among
quiet cases apart, whole cases: the same cases for all arms, so that their differences are paired.
"""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.benchmark.folder import read_rows, read_settings
from lgmd_gym.benchmark.statistics import DRAWS
from lgmd_gym.benchmark.summary import automatic, wilson
from lgmd_gym.benchmark.traffic.rows import SUITE as TRAFFIC
from lgmd_gym.errors import unknown_name

Row = dict[str, Any]
RETURN = "episode_return"
SHARES = ("avoided", "premature_brake", "false_activation")
ENOUGH = 5  # trainings; a bootstrap over fewer says less than it seems to


class Estimate(NamedTuple):
    """A value with its 95 % interval.

    Attributes:
        value: The value.
        low: Lower end; None for an arm of two to four trainings.
        high: Upper end; None likewise.
        n: Number of cases.
    """

    value: float
    low: float | None
    high: float | None
    n: int


class Arm(NamedTuple):
    """What an arm did under one condition.

    Attributes:
        name: The arm's.
        condition: The camera's.
        trainings: Agents in it. With one, intervals speak of the cases alone.
        returned: Interquartile mean, over the trainings, of the mean return.
        spread: Lowest and highest mean return of a training.
        less_first: Return less that of the first arm; None for the first itself.
        shares: Of `SHARES`, means over the trainings; without those that no case has.
    """

    name: str
    condition: str
    trainings: int
    returned: Estimate
    spread: tuple[float, float]
    less_first: Estimate | None
    shares: dict[str, Estimate]


def judge_run(path: Path, arms: Sequence[str] = ()) -> list[Arm]:
    """Judge the arms of a run, under each of its conditions.

    Args:
        path: Run folder.
        arms: "name=pattern", where the pattern matches the agents' strings as a shell's does (`*`, `?`), or
            an agent's string alone; none for one arm per agent.

    Raises:
        ValueError: For a folder without such a run, failed or missing episodes, or an arm of nobody.
    """
    rows, _ = read_rows(path)
    if read_settings(path)["suite"] == TRAFFIC:
        raise ValueError(f"{str(path)!r} is a traffic run, which has no returns")
    failed = sum(row["error"] is not None for row in rows)
    if failed or not rows:
        what = f"{failed} episodes failed" if failed else "no episode has been played"
        raise ValueError(f"{what}; go on with lgmd-gym bench --resume {path}")
    if any(row.get(RETURN) is None for row in rows):
        raise ValueError("the run has no returns: an older version made it; play it again")
    agents = list(dict.fromkeys(row["agent"] for row in rows))
    members = _members(arms or agents, agents)
    conditions = dict.fromkeys(row["condition"] for row in rows)
    return [arm for name in conditions for arm in judge_rows(automatic(rows), members, name)]


def judge_rows(rows: Sequence[Row], members: Sequence[tuple[str, list[str]]], condition: str) -> list[Arm]:
    """Judge arms on rows of one condition.

    Args:
        rows: Rows of all of them.
        members: Each arm's name and agents.
        condition: Which rows count.

    Raises:
        ValueError: If an agent lacks an episode of another's.
    """
    rows = [row for row in rows if row["condition"] == condition]
    first_agent = members[0][1][0]
    keys = sorted(_key(row) for row in rows if row["agent"] == first_agent)
    for agent in dict.fromkeys(agent for _, agents in members for agent in agents):
        if sorted(_key(row) for row in rows if row["agent"] == agent) != keys:
            raise ValueError(f"agent {agent!r} has not played all that {first_agent!r} has; resume the run")
    drawn = Draws(rows, first_agent)
    found: list[Arm] = []
    first: np.ndarray | None = None
    for name, agents in members:
        arm, returns = _judge(name, condition, agents, rows, drawn)
        if first is not None:
            arm = arm._replace(less_first=_difference(arm, returns, found[0], first))
        else:
            first = returns
        found.append(arm)
    return found


def interquartile_mean(values: Any) -> Any:
    """Return the mean of the middle half along the last axis; of fewer than four values, of all.

    Example:
        >>> float(interquartile_mean([0.0, 1.0, 2.0, 3.0, 100.0]))
        2.0
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=-1)
    cut = ordered.shape[-1] // 4
    return ordered[..., cut : ordered.shape[-1] - cut].mean(axis=-1)


class Draws:
    """Bootstrap samples of cases, the same for all arms.

    Args:
        rows: Rows of one condition.
        agent: Whose rows say which cases are threats.
        count: Number of samples.
    """

    def __init__(self, rows: Sequence[Row], agent: str, count: int = DRAWS) -> None:
        threat = {row["case"]: bool(row["threat"]) for row in rows if row["agent"] == agent}
        self.cases = sorted(threat)
        self.count = count
        self._weights = np.zeros((count, len(self.cases)))
        rng = np.random.default_rng(0)
        for kind in (True, False):
            chosen = np.array([threat[case] is kind for case in self.cases])
            n = int(chosen.sum())
            if n:
                self._weights[:, chosen] = rng.multinomial(n, np.full(n, 1.0 / n), size=count)

    def means(self, table: np.ndarray, seed: int) -> np.ndarray:
        """Return means of sampled cases for sampled trainings, shape (samples, trainings).

        Args:
            table: A value per training and case, NaN where a case has none.
            seed: Of the trainings' sampling.
        """
        has = np.isfinite(table[0])
        weights = self._weights[:, has]
        means = (weights @ table[:, has].T) / weights.sum(axis=1, keepdims=True)
        picks = np.random.default_rng(seed).integers(len(table), size=means.shape)
        return np.take_along_axis(means, picks, axis=1)


def _judge(
    name: str, condition: str, agents: list[str], rows: Sequence[Row], drawn: Draws
) -> tuple[Arm, np.ndarray]:
    """Return an arm and the samples of its return."""
    told = {agent: [row for row in rows if row["agent"] == agent] for agent in agents}
    table = _table(told, drawn.cases, RETURN)
    means = table.mean(axis=1)
    samples = interquartile_mean(drawn.means(table, seed=len(name)))
    n = len(drawn.cases)
    value = Estimate(float(interquartile_mean(means)), *_bounds(samples, len(agents)), n)
    shares = {}
    for key in SHARES:
        table = _table(told, drawn.cases, key, threat=key != "false_activation")
        if np.isfinite(table).any():
            shares[key] = _share(table, drawn.means(table, seed=len(name)).mean(axis=1))
    spread = (float(means.min()), float(means.max()))
    return Arm(name, condition, len(agents), value, spread, None, shares), samples


def _share(table: np.ndarray, samples: np.ndarray) -> Estimate:
    """Return a share with the wider of its bootstrap and Wilson's interval, each case counted once.

    A bootstrap of shares that are all 0 or all 1 has no width; Wilson's knows nothing of trainings.
    """
    n = int(np.isfinite(table[0]).sum())
    value = float(np.nanmean(table))
    low, high = _bounds(samples, len(table))
    if low is None or high is None:
        return Estimate(value, None, None, n)
    least, most = wilson(value * n, n)
    return Estimate(value, min(low, least), max(high, most), n)


def _difference(arm: Arm, samples: np.ndarray, first: Arm, others: np.ndarray) -> Estimate:
    fewest = min((arm.trainings, first.trainings), key=lambda count: (not 1 < count < ENOUGH, count))
    change = arm.returned.value - first.returned.value
    return Estimate(change, *_bounds(samples - others, fewest), arm.returned.n)


def _bounds(samples: np.ndarray, trainings: int) -> tuple[float | None, float | None]:
    if 1 < trainings < ENOUGH:
        return None, None
    low, high = np.percentile(samples, (2.5, 97.5))
    return float(low), float(high)


def _table(told: dict[str, list[Row]], cases: list[str], key: str, threat: bool | None = None) -> np.ndarray:
    """Return the mean of a key per agent and case, NaN for none; of threats or quiet episodes if asked."""
    table = np.full((len(told), len(cases)), np.nan)
    for line, rows in zip(table, told.values(), strict=True):
        values: dict[str, list[float]] = {}
        for row in rows:
            if row[key] is not None and threat in (None, row["threat"]):
                values.setdefault(row["case"], []).append(float(row[key]))
        for case, found in values.items():
            line[cases.index(case)] = np.mean(found)
    return table


def _key(row: Row) -> tuple[str, int]:
    return row["case"], row["seed"]


def _members(arms: Sequence[str], agents: list[str]) -> list[tuple[str, list[str]]]:
    """Return each arm's name and agents."""
    found = []
    for arm in arms:
        name, _, pattern = arm.partition("=")
        members = [agent for agent in agents if name and fnmatchcase(agent, pattern)]
        if arm in agents:
            name, members = arm, [arm]
        if not members:
            raise unknown_name("arm (an agent of the run, or name=pattern)", arm, agents)
        found.append((name, members))
    return found
