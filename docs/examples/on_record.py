"""Compare agents with a latching brake on episodes that are recorded once.

    python docs/examples/on_record.py 600 stopping-zone policy:zones

The number is the number of levels, drawn from the split `test` of `LGMD/RandomBraking-v0`, which no training
uses. They are recorded without braking through the cameras of the first agent; all agents must have the same
cameras. The result of an agent is the recorded outcome of braking at its first braking decision on the
recorded observations. Agents joined by "+", for example several training runs, are averaged. The columns
are the mean return with its 95 % bootstrap interval, its difference from the first arm on the same episodes,
and the shares of threats avoided and of non-threats with false activations.
"""

import sys
from collections.abc import Sequence
from functools import partial

import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.episodes import EpisodeRecorder, RecordedEpisode, record_parallel

RESAMPLES = 2000


def record(agent: str, count: int, jobs: int = 2) -> list[RecordedEpisode]:
    """Return episodes on levels of the test split, recorded through an agent's cameras."""
    config = TrainConfig.from_hyperparams("offline", sensors_of=agent, inputs=("ego_speed",))
    recorder = EpisodeRecorder(partial(config.make_env, "test"), hold=0, brake=1)
    return [episode for (episode,) in record_parallel(recorder.record, range(count), jobs)]


def evaluate(agent: str, episodes: list[RecordedEpisode]) -> np.ndarray:
    """Return for each episode its return, whether it ends in a contact, and whether the agent brakes."""
    made, results = make_agent(agent), []
    for episode in episodes:
        made.reset(0)
        onset = None
        for decision in range(len(episode)):
            observation = {name: array[decision] for name, array in episode.observations.items()}
            if made.act(observation, {})[0] < 0.0:
                onset = decision
                break
        if onset is None:
            results.append((episode.rewards.sum(), episode.threat, False))
        else:
            total = episode.rewards[:onset].sum() + episode.braking_returns[onset]
            results.append((total, episode.braking_contacts[onset], True))
    return np.array(results, dtype=float)


def interval(values: np.ndarray) -> str:
    """Return the mean with its 95 % bootstrap interval."""
    rng = np.random.default_rng(0)
    means = values[rng.integers(len(values), size=(RESAMPLES, len(values)))].mean(axis=1)
    low, high = np.percentile(means, (2.5, 97.5))
    return f"{values.mean():+.2f} [{low:+.2f}, {high:+.2f}]"


def main(arguments: Sequence[str]) -> None:
    """Record the episodes, evaluate every arm and print one line per arm."""
    count, arms = int(arguments[0]), arguments[1:]
    episodes = record(arms[0].split("+")[0], count)
    threats = np.array([episode.threat for episode in episodes])
    print(f"{count} levels of the test split, {threats.sum()} threats")
    print("return               difference           avoided  false  arm")
    reference = None
    for arm in arms:
        results = np.mean([evaluate(agent, episodes) for agent in arm.split("+")], axis=0)
        returns = results[:, 0]
        reference = returns if reference is None else reference
        avoided, false = 1.0 - results[threats, 1].mean(), results[~threats, 2].mean()
        difference = interval(returns - reference)
        print(f"{interval(returns)}  {difference}  {avoided:6.1%}  {false:5.1%}  {arm}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:] or ["600", "stopping-zone", "policy:zones"])
