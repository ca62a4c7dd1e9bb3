"""Comparison of arms: groups of agents over the same episodes, such as several training runs.

The mean return of an arm is the interquartile mean, over its training runs, of the mean over cases. Intervals
are from a stratified bootstrap that draws training runs, and cases from threats and non-threats separately.
All arms have the same case samples, so their differences are paired by case.
"""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
from rich.table import Table

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import Row
from lgmd_gym.benchmark.run_folder import read_case_rows
from lgmd_gym.benchmark.summary import (
    INTERVAL_TEXT,
    Sample,
    cases_and_worlds,
    interval_text,
    without_fcw_driver,
)
from lgmd_gym.errors import counted, unknown_name
from lgmd_gym.statistics.bootstrap import StratifiedBootstrap, interquartile_mean
from lgmd_gym.statistics.intervals import effective_size, wilson

RETURN = "episode_return"
SHARES = {
    "avoided": True,
    "premature_brake": True,
    "false_activation": False,
}  # row key -> whether over threats
MIN_TRAININGS = 5  # fewest training runs, apart from one, for which intervals are given


ARM_CAPTION = (
    "runs: trainings; return: interquartile mean over them [95 % interval, bootstrap over trainings and "
    "cases; of one training over cases only, of two to four none], below it the lowest and highest training; "
    f"difference: to the first arm, paired by case; shares: means over trainings [{INTERVAL_TEXT}]"
)
SHARE_HEADINGS = {"avoided": "avoided", "premature_brake": "premature", "false_activation": "false"}


class Estimate(NamedTuple):
    """Value over n cases with its 95 % interval; None as bounds for arms of two to four training runs."""

    value: float
    low: float | None
    high: float | None
    n: int


class Arm(NamedTuple):
    """Named group of agents, given by their strings."""

    name: str
    agents: list[str]


class ArmResult(NamedTuple):
    """Result of an arm under one camera condition.

    The interval of an arm of one training includes the variation over cases only.
    """

    name: str
    condition: str
    sample: Sample
    trainings: int
    mean_return: Estimate  # interquartile mean over training runs of the mean return
    return_range: tuple[float, float]  # lowest and highest mean return of a training run
    difference: Estimate | None  # mean return minus that of the first arm; None for the first arm
    shares: dict[str, Estimate]  # mean over training runs by key of SHARES; keys without a case are left out


def compare_arms(path: Path, arms: Sequence[str] = ()) -> list[ArmResult]:
    """Compare arms of a run under each of its conditions.

    Args:
        path: Run folder.
        arms: Arms as "NAME=AGENT,AGENT,..." with shell patterns (`*`, `?`) allowed for agents, or single
            agent strings. Empty for one arm per agent.

    Raises:
        ValueError: For a folder without a run, a traffic run, failed or missing episodes, or an arm without
            an agent.
    """
    rows = read_case_rows(path)
    failed = sum(row["error"] is not None for row in rows)
    if failed or not rows:
        problem = f"{counted(failed, 'episode')} failed" if failed else "the run has no episode"
        raise ValueError(f"{problem}; resume it with lgmd-gym bench --resume {path}")
    agents = list(dict.fromkeys(row["agent"] for row in rows))
    parsed = [parse_arm(arm, agents) for arm in arms or agents]
    conditions = dict.fromkeys(row["condition"] for row in rows)
    return [result for name in conditions for result in arm_results(without_fcw_driver(rows), parsed, name)]


def parse_arm(text: str, agents: Sequence[str]) -> Arm:
    """Return the arm that a string describes, see `compare_arms`.

    Raises:
        ValueError: If no agent matches.
    """
    if text in agents:
        return Arm(text, [text])
    name, _, patterns = text.partition("=")
    # Agent strings may contain commas, so the whole text is tried as one pattern first.
    members = _matching(agents, [patterns]) or _matching(agents, patterns.split(","))
    if not name or not members:
        raise unknown_name("arm (an agent of the run, or NAME=AGENT,AGENT,...)", text, agents)
    return Arm(name, members)


def _matching(agents: Sequence[str], patterns: list[str]) -> list[str]:
    """Return the agents that match any pattern; none if a pattern matches no agent."""
    if not all(any(fnmatchcase(agent, pattern) for agent in agents) for pattern in patterns):
        return []
    return [agent for agent in agents if any(fnmatchcase(agent, pattern) for pattern in patterns)]


def arm_results(rows: Sequence[Row], arms: Sequence[Arm], condition: str) -> list[ArmResult]:
    """Return the results of arms on the rows of one condition.

    Raises:
        ValueError: If the agents do not have the same episodes.
    """
    rows = [row for row in rows if row["condition"] == condition]
    by_agent = {
        agent: [row for row in rows if row["agent"] == agent]
        for agent in dict.fromkeys(agent for arm in arms for agent in arm.agents)
    }
    first_agent = arms[0].agents[0]
    episodes = _episodes(by_agent[first_agent])
    for agent, of_agent in by_agent.items():
        if _episodes(of_agent) != episodes:
            raise ValueError(f"agents {agent!r} and {first_agent!r} have different episodes; resume the run")
    bootstrap = StratifiedBootstrap({row["case"]: bool(row["threat"]) for row in by_agent[first_agent]})
    results: list[ArmResult] = []
    first_samples: np.ndarray | None = None
    for arm in arms:
        result, samples = _arm_result(arm, condition, by_agent, bootstrap)
        if first_samples is None:
            first_samples = samples
        else:
            result = result._replace(difference=_difference(result, samples, results[0], first_samples))
        results.append(result)
    return results


def _arm_result(
    arm: Arm, condition: str, by_agent: dict[str, list[Row]], bootstrap: StratifiedBootstrap
) -> tuple[ArmResult, np.ndarray]:
    """Return the result of an arm without its difference, and the bootstrap samples of its mean return."""
    groups, seed = [by_agent[agent] for agent in arm.agents], len(arm.name)
    returns = _case_means(groups, bootstrap.cases, RETURN)
    means = returns.mean(axis=1)
    samples = interquartile_mean(bootstrap.means(returns, seed))
    bounds = _bounds(samples, len(groups))
    shares = {}
    for key, threats in SHARES.items():
        values = _case_means(groups, bootstrap.cases, key, threats)
        if np.isfinite(values).any():
            rows = [row for group in groups for row in group if row["threat"] == threats]
            shares[key] = _share(values, bootstrap.means(values, seed).mean(axis=1), rows, key)
    mean_return = Estimate(float(interquartile_mean(means)), *bounds, len(bootstrap.cases))
    return_range = (float(means.min()), float(means.max()))
    result = ArmResult(
        arm.name, condition, Sample.of(groups[0]), len(groups), mean_return, return_range, None, shares
    )
    return result, samples


def _share(values: np.ndarray, samples: np.ndarray, rows: list[Row], key: str) -> Estimate:
    """Return a share with the union of its bootstrap interval and Wilson's for the effective sample size.

    The bootstrap of shares that are all 0 or all 1 has no width, and draws no worlds. Wilson's interval does
    not include the variation over training runs.
    """
    n = int(np.isfinite(values[0]).sum())
    value = float(np.nanmean(values))
    low, high = _bounds(samples, len(values))
    if low is None or high is None:
        return Estimate(value, None, None, n)
    size = effective_size([bool(cast(Values, row)[key]) for row in rows], *cases_and_worlds(rows))
    wilson_low, wilson_high = wilson(value * size, size)
    return Estimate(value, min(low, wilson_low), max(high, wilson_high), n)


def _difference(
    result: ArmResult, samples: np.ndarray, first: ArmResult, first_samples: np.ndarray
) -> Estimate:
    counts = (result.trainings, first.trainings)
    fewest = min(counts, key=lambda count: (_has_interval(count), count))
    value = result.mean_return.value - first.mean_return.value
    return Estimate(value, *_bounds(samples - first_samples, fewest), result.mean_return.n)


def _has_interval(trainings: int) -> bool:
    return not 1 < trainings < MIN_TRAININGS


def _bounds(samples: np.ndarray, trainings: int) -> tuple[float | None, float | None]:
    """Return the 95 % percentile interval; (None, None) for two to four training runs."""
    if not _has_interval(trainings):
        return None, None
    low, high = np.percentile(samples, (2.5, 97.5))
    return float(low), float(high)


def _case_means(
    groups: Sequence[Sequence[Row]], cases: Sequence[str], key: str, threats: bool | None = None
) -> np.ndarray:
    """Return the mean of a row key per group and case; NaN without a value.

    `threats` restricts the rows to threats or to non-threats.
    """
    means = np.full((len(groups), len(cases)), np.nan)
    for line, rows in zip(means, groups, strict=True):
        values: dict[str, list[float]] = {}
        for row in rows:
            if row[key] is not None and threats in (None, row["threat"]):
                values.setdefault(row["case"], []).append(float(cast(Values, row)[key]))
        for case, of_case in values.items():
            line[cases.index(case)] = np.mean(of_case)
    return means


def _episodes(rows: Sequence[Row]) -> list[tuple[str, int]]:
    return sorted((row["case"], row["seed"]) for row in rows)


def arm_table(results: Sequence[ArmResult], title: str) -> Table:
    """Return a table with one line per arm; all arms have the same condition."""
    keys = [key for key in SHARE_HEADINGS if key in results[0].shares]
    table = Table(title=title, caption=f"{results[0].sample}; {ARM_CAPTION}")
    table.add_column("arm", min_width=15, overflow="fold")
    for heading in ("runs", "return", "difference\nto the first"):
        table.add_column(heading, justify="right")
    for key in keys:
        heading = f"{SHARE_HEADINGS[key]},\n% of {results[0].shares[key].n}"
        table.add_column(heading, justify="right")
    for result in results:
        mean_return = interval_text(result.mean_return, ".1f")
        if result.trainings > 1:
            low, high = result.return_range
            mean_return += f"\n{low:.1f} to\n{high:.1f}"
        difference = "–" if result.difference is None else interval_text(result.difference, "+.1f")
        shares = (interval_text(result.shares[key], ".0f", 100.0) for key in keys)
        cells = (result.name, str(result.trainings), mean_return, difference, *shares)
        table.add_row(*cells)
    return table
