# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Does a policy recognise threats of a family that its training lacks?

    python docs/experiments/leave_one_out.py runs/all-round --families CutIn CPNA CCCscp --jobs 2

The folder is one of `lgmd-gym train --algo time-to-brake`. A family is that of the recorded scenario: CutIn
includes the levels of CutInThreat and those without their target. The levels of the families with an odd seed
are set aside for the test. One network is trained on all other training episodes, and one per family on those
that are not of this family; nor does it select the epoch. All start from random weights. The table has the
shares of the tested threats that are recognised in time: the log odds of full braking exceed a threshold
while full braking still avoids the contact, and before the recorded driver brakes. Threats in which the
driver brakes earlier than 0.3 s before the last moment are left out. The threshold of each network is the one
that 5 % of the validation levels without a threat exceed. Levels of `error_levels` count as the others.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import chain, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch

from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.errors import check_known
from lgmd_gym.statistics.intervals import Rate
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.dataset import StateDataset
from lgmd_gym.training.offline.episodes import TRAFFIC, DrivenEpisode
from lgmd_gym.training.offline.time_to_brake import EVALUATED_STATES, TimeToBrakeLearner
from lgmd_gym.training.recordings import check_recordings, load_or_record, recording_sets
from lgmd_gym.training.trainer import CONFIG_FILE

FALSE_SHARE = 0.05
LATE_S = 0.3  # time to brake up to which the recorded driver must wait


class Level(NamedTuple):
    """A recorded level without its observations."""

    family: str
    threat: bool
    in_time: np.ndarray  # whether full braking avoids the contact, at each decision before the driver brakes
    waits: bool  # whether the driver does not brake early


class Levels:
    """Recorded episodes as decisions.

    Args:
        episodes: The episodes; their observations are not kept.
        config: Training run that recorded them.
        limits_s: Upper ends of the intervals of the time to brake [s].

    Attributes:
        dataset: The decisions.
        levels: The episodes.
    """

    def __init__(
        self, episodes: Iterator[DrivenEpisode], config: TrainConfig, limits_s: Sequence[float]
    ) -> None:
        self.levels: list[Level] = []
        repeat = config.features.repeat

        def noted() -> Iterator[DrivenEpisode]:
            for episode in episodes:
                braking = np.flatnonzero(episode.demands < 0.0)
                times = episode.time_to_brake[: braking[0] + 1 if braking.size else None]
                waits = bool((times <= LATE_S).any())
                self.levels.append(Level(episode.family, episode.threat, times[::repeat] > 0.0, waits))
                yield episode

        self.dataset = StateDataset(noted(), config.features, limits_s)

    def part(self, chosen: Sequence[int]) -> "Part":
        """Return the decisions of some episodes."""
        return Part(self.dataset, chosen)


class Part:
    """Some episodes of a `StateDataset`, which is not copied."""

    def __init__(self, dataset: StateDataset, episodes: Sequence[int]) -> None:
        parts = [np.arange(*dataset.bounds[index : index + 2]) for index in episodes]
        self._dataset, self._indices = dataset, np.concatenate(parts)
        self.bounds = np.cumsum([0, *map(len, parts)])
        self.times, self.classes = dataset.times[self._indices], dataset.classes[self._indices]
        self.braking, self.in_traffic = dataset.braking[self._indices], dataset.in_traffic[self._indices]

    def __len__(self) -> int:
        return len(self._indices)

    def batch(self, indices: np.ndarray, mirrored: np.ndarray | None = None) -> torch.Tensor:
        """Return features; see `StateDataset.batch`."""
        return self._dataset.batch(self._indices[indices], mirrored)


def highest_odds(learner: TimeToBrakeLearner, source: Levels, chosen: Sequence[int]) -> np.ndarray:
    """Return the highest log odds of full braking in each level; of a threat, while it is in time."""
    counts = np.diff(source.dataset.bounds)[list(chosen)]
    limit = learner.brake.limits_s.index(learner.brake.full_s)
    parts: list[Any] = [
        Part(source.dataset, part.tolist())
        for part in np.array_split(list(chosen), min(-(-counts.sum() // EVALUATED_STATES), len(chosen)))
    ]
    odds = np.concatenate([learner.odds(part)[:, limit] for part in parts])
    found: list[float] = []
    for index, (first, last) in zip(chosen, pairwise(np.cumsum([0, *counts])), strict=True):
        level = source.levels[index]
        values = odds[first:last][: len(level.in_time)]
        found.append(float(values[level.in_time].max(initial=-np.inf)))
    return np.array(found)


def tested_levels(source: Levels, config: TrainConfig, families: Sequence[str]) -> dict[str, list[int]]:
    """Return the indices of the training levels of each family with an odd seed.

    The same level without its target has the same seed, in another set.
    """
    sets = [item for item in recording_sets(config, "train") if TRAFFIC not in item.name]
    seeds = chain.from_iterable(item.seeds for item in sets)  # levels come first, one per seed
    chosen = {family: list[int]() for family in families}
    for index, (level, seed) in enumerate(zip(source.levels, seeds, strict=False)):
        if level.family in chosen and seed % 2:
            chosen[level.family].append(index)
    return chosen


def threshold_of(odds: np.ndarray) -> float:
    """Return the log odds that `FALSE_SHARE` of some levels exceed, from the highest of each level."""
    return float(np.quantile(odds, 1.0 - FALSE_SHARE))


def make_learner(config: TrainConfig, epochs: int) -> TimeToBrakeLearner:
    """Return a learner of one network with random weights: a start may have been trained on every family."""
    env = config.make_policy_env("train")
    recipe: Any = config.algo_kwargs | {"n_networks": 1, "n_epochs": epochs, "start_share": 0.0}
    if config.start is not None:
        recipe |= {"learning_rate": 0.004, "batch_size": 1024}  # those of the folder continue a training
    env.close()
    return TimeToBrakeLearner(config.policy, env, seed=config.seed, **recipe)


def main(arguments: Sequence[str] | None = None) -> dict[str, tuple[Rate, Rate]]:
    """Print the table; return the rates by family, trained with and without it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of lgmd-gym train")
    parser.add_argument("--families", nargs="+", required=True, help="families of scenarios")
    parser.add_argument("--epochs", type=int, default=3, help="number of passes over the episodes")
    parser.add_argument("--jobs", type=int, default=1, help="number of threads")
    options = parser.parse_args(arguments)
    config = TrainConfig.from_dict(json.loads((options.folder / CONFIG_FILE).read_text()))
    config = replace(config, recordings=config.recordings or str(options.folder))
    check_recordings(config)
    torch.set_num_threads(1)
    # before the threads, because stable-baselines3 seeds the generator that they share
    learners = [make_learner(config, options.epochs) for _ in (None, *options.families)]
    limits = learners[0].brake.limits_s
    source = Levels(load_or_record(config, "train", options.folder), config, limits)
    validation = Levels(load_or_record(config, "validation", options.folder), config, limits)
    tested = tested_levels(source, config, options.families)
    threats = {
        family: [k for k in chosen if source.levels[k].threat and source.levels[k].waits]
        for family, chosen in tested.items()
    }
    known = sorted({item.family for item in source.levels if item.threat and item.family != TRAFFIC})
    for family, chosen in threats.items():
        check_known("family of the recordings", family, known)
        if not chosen:
            raise ValueError(
                f"the recordings have no threat of {family} with an odd seed; record more levels"
            )
    aside = {index for chosen in tested.values() for index in chosen}
    harmless = [
        index for index, item in enumerate(validation.levels) if not item.threat and item.family != TRAFFIC
    ]

    def recognised(learner: TimeToBrakeLearner, without: str | None) -> dict[str, Rate]:
        """Train without a family, and return the share of recognised threats of each family."""
        train, selection = (
            levels.part(
                [
                    index
                    for index, item in enumerate(levels.levels)
                    if item.family != without and not (levels is source and index in aside)
                ]
            )
            for levels in (source, validation)
        )
        learner.learn(train, selection)  # type: ignore[arg-type]
        threshold = threshold_of(highest_odds(learner, validation, harmless))
        return {
            family: Rate.of((highest_odds(learner, source, chosen) > threshold).tolist())
            for family, chosen in threats.items()
        }

    with ThreadPoolExecutor(options.jobs) as executor:
        complete, *others = executor.map(recognised, learners, [None, *options.families])
    found = {
        family: (complete[family], other[family])
        for family, other in zip(options.families, others, strict=True)
    }
    print("| family | recognised, trained with it | trained without it |\n|---|---:|---:|")
    for family, rates in found.items():
        print(f"| {family} | {' | '.join(map(rate_text, rates))} |")
    return found


if __name__ == "__main__":
    main()
