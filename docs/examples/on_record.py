"""Agents that brake for good, compared on drives that are recorded once: one eye, the same drives for all.

    python docs/examples/on_record.py 600 stopping-zone policy:zones

The number is that of levels, drawn from the split `test` of `LGMD/RandomBraking-v0`; nobody learns from them.
The first agent's eye sees them, without braking; all others must have the same. Then each agent is asked on
the record when it brakes, and what that leads to is on record, too. Agents joined by "+", such as several
trainings, count as one: their mean. Printed are the mean return with its interval (95 %, drives drawn with
replacement), what it is less the first one's on the same drives, and the shares of threats avoided and of
quiet drives with false braking.
"""

import sys
from collections.abc import Sequence

import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.training.config import Order
from lgmd_gym.training.offline.episodes import Drive, record

DRAWS = 2000


def recorded(agent: str, count: int, jobs: int = 2) -> list[Drive]:
    """Return drives on levels of the test split through an agent's own eye."""
    plan = Order("recorded", eye=agent, inputs=("ego_speed",)).plan()
    return record(plan, "test", range(count), jobs, lambda done: None)


def braked(agent: str, drives: list[Drive]) -> np.ndarray:
    """Return, for each drive, its return, whether it ended in a contact, and whether the agent braked."""
    made, told = make_agent(agent), []
    for drive in drives:
        made.reset(0)
        moments = ({name: array[k] for name, array in drive.seen.items()} for k in range(len(drive)))
        onset = next((k for k, moment in enumerate(moments) if made.act(moment, {})[0] < 0.0), None)
        if onset is None:
            told.append((drive.rewards.sum(), drive.threat, False))
        else:
            held = drive.rewards[:onset].sum()
            told.append((held + drive.returns[onset], drive.contacts[onset], True))
    return np.array(told, dtype=float)


def interval(values: np.ndarray) -> str:
    """Return the mean with its bootstrapped 95 % interval."""
    rng = np.random.default_rng(0)
    means = values[rng.integers(len(values), size=(DRAWS, len(values)))].mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return f"{values.mean():+.2f} [{low:+.2f}, {high:+.2f}]"


def main(arguments: Sequence[str]) -> None:
    """Record, ask, and print."""
    count, arms = int(arguments[0]), arguments[1:]
    drives = recorded(arms[0].split("+")[0], count)
    threats = np.array([drive.threat for drive in drives])
    print(f"{count} levels of the test split, {threats.sum()} threats")
    print("return               less the first       avoided  false  arm")
    first = None
    for arm in arms:
        told = np.mean([braked(agent, drives) for agent in arm.split("+")], axis=0)
        first = told[:, 0] if first is None else first
        less = interval(told[:, 0] - first)
        avoided, false = 1.0 - told[threats, 1].mean(), told[~threats, 2].mean()
        print(f"{interval(told[:, 0])}  {less}  {avoided:6.1%}  {false:5.1%}  {arm}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["600", "stopping-zone", "policy:zones"])
