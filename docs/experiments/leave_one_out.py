# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Does a policy recognise threats of a family that is not in its training?

    python docs/experiments/leave_one_out.py runs/all-round --families CutInThreat CPNA CCCscp --jobs 2

The folder is one of `lgmd-gym train --algo time-to-brake`. One network is trained on all of its recordings,
and one for each family without the levels of this family. The table has their results on the recorded
validation levels of the family: the share of the threats that the network recognises in time, that is, whose
log odds of full braking exceed a threshold while full braking still avoids the contact and before the
recorded driver brakes. Threats in which the driver brakes earlier than 0.3 s before the last moment are left
out. The threshold of each network is the one that 5 % of the validation levels without a threat exceed.
"""

import argparse
import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from joblib import Parallel, delayed

from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.errors import check_known
from lgmd_gym.statistics.intervals import Rate
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.dataset import StateDataset
from lgmd_gym.training.offline.episodes import DrivenEpisode
from lgmd_gym.training.offline.time_to_brake import TimeToBrakeLearner
from lgmd_gym.training.recordings import load_or_record
from lgmd_gym.training.trainer import CONFIG_FILE

FALSE_SHARE = 0.05
LATE_S = 0.3  # time to brake up to which the recorded driver must wait


class Levels(NamedTuple):
    """Validation levels up to the first braking of the recorded driver."""

    families: list[str]
    odds: list[np.ndarray]  # log odds of full braking at each decision
    in_time: list[np.ndarray]  # whether full braking still avoids the contact
    threats: list[bool]

    def threshold(self) -> float:
        """Return the log odds that `FALSE_SHARE` of the levels without a threat exceed."""
        highest = [odds.max() for odds, threat in zip(self.odds, self.threats, strict=True) if not threat]
        return float(np.quantile(highest, 1.0 - FALSE_SHARE))

    def recognised(self, family: str) -> Rate:
        """Return the share of the threats of a family that are recognised in time."""
        limit = self.threshold()
        return Rate.of(
            bool((odds[in_time] > limit).any())
            for name, odds, in_time, threat in zip(*self, strict=True)
            if threat and name == family
        )


def prefix_length(episode: DrivenEpisode) -> int:
    """Return the number of decisions up to the first one with braking."""
    braking = np.flatnonzero(episode.demands < 0.0)
    return int(braking[0]) + 1 if braking.size else len(episode)


def is_used(episode: DrivenEpisode) -> bool:
    """Return whether a level counts: not one of traffic, nor a threat with an early brake of the driver."""
    times = episode.time_to_brake[: prefix_length(episode)]
    return not episode.traffic and (not episode.threat or bool((times <= LATE_S).any()))


def train(
    config: TrainConfig, folder: Path, without: str | None, validation: Sequence[DrivenEpisode]
) -> Levels:
    """Return the results of a network that is trained without the levels of a family."""
    torch.set_num_threads(1)
    env = config.make_policy_env("train")
    learner = TimeToBrakeLearner(
        config.policy, env, seed=config.seed, **(config.algo_kwargs | {"n_networks": 1})
    )
    env.close()
    limits = learner.brake.limits_s
    episodes = (item for item in load_or_record(config, "train", folder) if item.family != without)
    data = StateDataset(episodes, config.features, limits)
    whole = StateDataset(validation, config.features, limits)
    learner.learn(data, whole)
    return results(learner, config, validation)


def results(learner: TimeToBrakeLearner, config: TrainConfig, validation: Iterable[DrivenEpisode]) -> Levels:
    """Return the log odds of a learner on the validation levels."""
    found = Levels([], [], [], [])
    repeat, limit = config.features.repeat, learner.brake.limits_s.index(learner.brake.full_s)
    for episode in filter(is_used, validation):
        count = -(-prefix_length(episode) // repeat)
        data = StateDataset([episode], config.features, learner.brake.limits_s)
        found.families.append(episode.family)
        found.odds.append(learner.odds(data)[:count, limit])
        found.in_time.append((episode.time_to_brake[::repeat] > 0.0)[:count])
        found.threats.append(episode.threat)
    return found


def main(arguments: Sequence[str] | None = None) -> dict[str, tuple[Rate, Rate]]:
    """Print the table; return the rates by family, trained with and without it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--families", nargs="+", required=True)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args(arguments)
    config = TrainConfig.from_dict(json.loads((options.folder / CONFIG_FILE).read_text()))
    config = replace(config, recordings=str(options.folder))
    validation = list(load_or_record(config, "validation", options.folder))
    known = sorted({item.family for item in validation if item.threat and is_used(item)})
    for family in options.families:
        check_known("family of the recordings", family, known)
    arms = [None, *options.families]
    run = delayed(train)
    complete, *others = Parallel(options.jobs)(run(config, options.folder, arm, validation) for arm in arms)
    print("| family | recognised in time, trained with it | trained without it |\n|---|---|---|")
    found = {}
    for family, other in zip(options.families, others, strict=True):
        found[family] = (complete.recognised(family), other.recognised(family))
        print(f"| {family} | {' | '.join(map(rate_text, found[family]))} |")
    return found


if __name__ == "__main__":
    main()
