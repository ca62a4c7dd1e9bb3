"""Arms over the same episodes: several trainings of one kind of policy, or a rule, which is an arm of one."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.benchmark.bootstrap import DRAWS
from lgmd_gym.benchmark.folder import read_rows, read_settings
from lgmd_gym.benchmark.rows import key_of
from lgmd_gym.benchmark.summary import automatic, wilson
from lgmd_gym.benchmark.traffic_rows import SUITE as TRAFFIC
from lgmd_gym.errors import unknown_name

Row = dict[str, Any]


class Share(NamedTuple):
    """A share of episodes, mean over an arm's trainings, with its Wilson interval.

    The interval counts each episode once, however many trainings played it: they meet the same road.
    """

    value: float
    low: float
    high: float
    n: int


class Arm(NamedTuple):
    """What an arm did.

    Attributes:
        name: The arm's.
        trainings: Agents in it.
        value: Interquartile mean, over the trainings, of the mean return.
        low: Lower end of its 95 % interval.
        high: Upper end.
        spread: Lowest and highest mean return of a training.
        avoided: Share of the threats; None without any.
        premature: Share of the threats braked for too early; None without any.
        false_brakes: Share of the quiet episodes; None without any.
    """

    name: str
    trainings: int
    value: float
    low: float
    high: float
    spread: tuple[float, float]
    avoided: Share | None
    premature: Share | None
    false_brakes: Share | None


def judge_run(path: Path, arms: Sequence[str]) -> list[Arm]:
    """Judge the arms of a run.

    Args:
        path: Run folder.
        arms: "name=pattern", where the pattern matches the agents' strings as a shell's does (`*`, `?`), or
            an agent's string alone; none for one arm per agent.

    Raises:
        ValueError: For a folder without such a run, an arm that matches nobody, or episodes that one of its
            agents has and another has not.
    """
    rows, _ = read_rows(path)
    if read_settings(path)["suite"] == TRAFFIC:
        raise ValueError(f"{str(path)!r} is a traffic run, which has no returns")
    rows = [row for row in automatic(rows) if row["error"] is None]
    agents = list(dict.fromkeys(row["agent"] for row in rows))
    return [judge(name, members, rows) for name, members in _members(arms or agents, agents)]


def judge(name: str, members: Sequence[str], rows: Sequence[Row]) -> Arm:
    """Judge one arm on the rows of its members.

    Raises:
        ValueError: If one of them lacks an episode of another's.
    """
    played = [{key_of(row)[1:]: row for row in rows if row["agent"] == agent} for agent in members]
    keys = sorted(played[0])
    for agent, own in zip(members, played, strict=True):
        if sorted(own) != keys:
            raise ValueError(f"agent {agent!r} has not played all that {members[0]!r} has; resume the run")
    table = [[own[key] for key in keys] for own in played]
    if any(row.get("episode_return") is None for row in table[0]):
        raise ValueError("the run has no returns: an older version made it; play it again")
    returns = np.array([[row["episode_return"] for row in line] for line in table])
    threats = np.array([row["threat"] for row in table[0]], dtype=bool)
    means = returns.mean(axis=1)
    low, high = interval(returns, threats)
    return Arm(
        name,
        len(members),
        interquartile_mean(means),
        low,
        high,
        (float(means.min()), float(means.max())),
        _share(table, "avoided", threats),
        _share(table, "premature_brake", threats),
        _share(table, "false_brake", ~threats),
    )


def interquartile_mean(values: Any) -> Any:
    """Return the mean of the middle half along the last axis; of fewer than four values, of all.

    Example:
        >>> float(interquartile_mean([0.0, 1.0, 2.0, 3.0, 100.0]))
        2.0
    """
    ordered = np.sort(np.asarray(values, dtype=np.float64), axis=-1)
    cut = ordered.shape[-1] // 4
    return ordered[..., cut : ordered.shape[-1] - cut].mean(axis=-1)


def interval(returns: np.ndarray, strata: np.ndarray, draws: int = DRAWS) -> tuple[float, float]:
    """Return the 95 % interval of the interquartile mean over trainings of the mean return.

    A stratified bootstrap: each draw takes trainings, and within each stratum episodes, the same for all
    trainings. The interquartile mean is taken over trainings and not over episodes, whose worst quarter is
    the contacts.

    Args:
        returns: Shape (trainings, episodes).
        strata: Of each episode, shape (episodes,).
        draws: Number of bootstrap samples.
    """
    rng = np.random.default_rng(0)
    trainings, episodes = returns.shape
    means = np.zeros((draws, trainings))
    for stratum in np.unique(strata):
        part = returns[:, strata == stratum]
        n = part.shape[1]
        means += rng.multinomial(n, np.full(n, 1.0 / n), size=draws) @ part.T / episodes
    drawn = np.take_along_axis(means, rng.integers(trainings, size=(draws, trainings)), axis=1)
    low, high = np.percentile(interquartile_mean(drawn), (2.5, 97.5))
    return float(low), float(high)


def _members(arms: Sequence[str], agents: list[str]) -> list[tuple[str, list[str]]]:
    """Return each arm's name and agents."""
    found = []
    for arm in arms:
        if arm in agents:
            found.append((arm, [arm]))
            continue
        name, sign, pattern = arm.partition("=")
        members = [agent for agent in agents if sign and fnmatchcase(agent, pattern)]
        if not members:
            raise unknown_name("agent, or name=pattern of agents,", pattern or arm, agents)
        found.append((name, members))
    return found


def _share(table: list[list[Row]], key: str, wanted: np.ndarray) -> Share | None:
    n = int(wanted.sum())
    if n == 0:
        return None
    value = float(np.mean([[bool(row[key]) for row, is_in in zip(line, wanted, strict=True) if is_in]
                           for line in table]))  # fmt: skip
    return Share(value, *wilson(value * n, n), n)
