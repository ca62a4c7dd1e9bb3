# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Does a policy recognise threats of a family that its training lacks?

    python docs/experiments/leave_one_out.py runs/all-round --families CutInThreat CPNA CCCscp --jobs 2

The folder is one of `lgmd-gym train --algo time-to-brake`, with its recorded episodes. Every second training
level of the families is set aside for the test. One network is trained on all other training episodes, and
one per family on those without any level of this family. The table has the shares of the tested threats that
are recognised in time: the log odds of full braking exceed a threshold while full braking still avoids the
contact, and before the recorded driver brakes. Threats in which the driver brakes earlier than 0.3 s before
the last moment are left out. The threshold of each network is the one that 5 % of the validation levels
without a threat exceed.
"""

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
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
from lgmd_gym.training.offline.time_to_brake import TimeToBrakeLearner
from lgmd_gym.training.recordings import load_or_record
from lgmd_gym.training.trainer import CONFIG_FILE

FALSE_SHARE = 0.05
AT_ONCE = 4096  # decisions
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
        bounds: First decision of each episode, and the number of decisions.
    """

    def __init__(
        self, episodes: Iterator[DrivenEpisode], config: TrainConfig, limits_s: Sequence[float]
    ) -> None:
        self.levels: list[Level] = []
        lengths, repeat = [0], config.features.repeat

        def noted() -> Iterator[DrivenEpisode]:
            for episode in episodes:
                braking = np.flatnonzero(episode.demands < 0.0)
                times = episode.time_to_brake[: braking[0] + 1 if braking.size else None]
                waits = bool((times <= LATE_S).any())
                self.levels.append(Level(episode.family, episode.threat, times[::repeat] > 0.0, waits))
                lengths.append(-(-len(episode) // repeat))
                yield episode

        self.dataset = StateDataset(noted(), config.features, limits_s)
        self.bounds = np.cumsum(lengths)

    def part(self, chosen: Sequence[int]) -> "Part":
        """Return the decisions of some episodes."""
        return Part(self.dataset, self.decisions(chosen))

    def decisions(self, chosen: Sequence[int]) -> np.ndarray:
        """Return the indices of the decisions of some episodes."""
        return np.concatenate([np.arange(*self.bounds[index : index + 2]) for index in chosen])


class Part:
    """Some decisions of a `StateDataset`, which is not copied."""

    def __init__(self, dataset: StateDataset, indices: np.ndarray) -> None:
        self._dataset, self._indices = dataset, indices
        self.classes, self.braking = dataset.classes[indices], dataset.braking[indices]
        self.in_traffic = dataset.in_traffic[indices]

    def __len__(self) -> int:
        return len(self._indices)

    def batch(self, indices: np.ndarray, mirrored: np.ndarray | None = None) -> torch.Tensor:
        """Return features; see `StateDataset.batch`."""
        return self._dataset.batch(self._indices[indices], mirrored)


def highest_odds(learner: TimeToBrakeLearner, source: Levels, chosen: Sequence[int]) -> np.ndarray:
    """Return the highest log odds of full braking in each level; of a threat, while it is in time."""
    indices = source.decisions(chosen)
    limit = learner.brake.limits_s.index(learner.brake.full_s)
    parts: list[Any] = [
        Part(source.dataset, part) for part in np.array_split(indices, -(-len(indices) // AT_ONCE))
    ]
    odds = np.concatenate([learner.odds(part)[:, limit] for part in parts])
    counts = np.diff(source.bounds)[list(chosen)]
    found: list[float] = []
    for index, (first, last) in zip(chosen, pairwise(np.cumsum([0, *counts])), strict=True):
        level = source.levels[index]
        values = odds[first:last][: len(level.in_time)]
        found.append(float(values[level.in_time].max(initial=-np.inf)))
    return np.array(found)


def tested_levels(levels: Sequence[Level], families: Sequence[str]) -> dict[str, list[int]]:
    """Return the indices of every second level of each family."""
    seen, chosen = Counter[str](), {family: list[int]() for family in families}
    for index, level in enumerate(levels):
        if level.family in chosen:
            if seen[level.family] % 2:
                chosen[level.family].append(index)
            seen[level.family] += 1
    return chosen


def main(arguments: Sequence[str] | None = None) -> dict[str, tuple[Rate, Rate]]:
    """Print the table; return the rates by family, trained with and without it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder of lgmd-gym train")
    parser.add_argument("--families", nargs="+", required=True, help="families of scenarios")
    parser.add_argument("--epochs", type=int, default=3, help="number of passes over the episodes")
    parser.add_argument("--jobs", type=int, default=1, help="number of threads")
    options = parser.parse_args(arguments)
    config = TrainConfig.from_dict(json.loads((options.folder / CONFIG_FILE).read_text()))
    config = replace(config, recordings=str(options.folder))
    torch.set_num_threads(1)

    def make_learner() -> TimeToBrakeLearner:
        env = config.make_policy_env("train")
        recipe: Any = config.algo_kwargs | {"n_networks": 1, "n_epochs": options.epochs}
        env.close()
        return TimeToBrakeLearner(config.policy, env, seed=config.seed, **recipe)

    limits = make_learner().brake.limits_s
    source = Levels(load_or_record(config, "train", options.folder), config, limits)
    validation = Levels(load_or_record(config, "validation", options.folder), config, limits)
    for family in options.families:
        check_known("family of the recordings", family, sorted({item.family for item in source.levels}))
    tested = tested_levels(source.levels, options.families)
    aside = {index for chosen in tested.values() for index in chosen}
    harmless = [
        index for index, item in enumerate(validation.levels) if not item.threat and item.family != TRAFFIC
    ]

    def recognised(without: str | None) -> dict[str, Rate]:
        """Train without a family, and return the share of recognised threats of each family."""
        used = [
            index for index, item in enumerate(source.levels) if index not in aside and item.family != without
        ]
        learner, train, whole = make_learner(), source.part(used), range(len(validation.levels))
        learner.learn(train, validation.part(whole))  # type: ignore[arg-type]
        threshold = np.quantile(highest_odds(learner, validation, harmless), 1.0 - FALSE_SHARE)
        rates: dict[str, Rate] = {}
        for family, chosen in tested.items():
            threats = [k for k in chosen if source.levels[k].threat and source.levels[k].waits]
            odds = highest_odds(learner, source, threats)
            rates[family] = Rate.of((odds > threshold).tolist())
        return rates

    with ThreadPoolExecutor(options.jobs) as executor:
        complete, *others = executor.map(recognised, [None, *options.families])
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
