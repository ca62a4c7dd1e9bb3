# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Does a policy read the time since the start of a level?

    python docs/experiments/start_time.py all-round runs/all-round

The folder is one of `lgmd-gym train --algo time-to-brake`. The policy judges its validation levels as they
were recorded, and once more without a first part of random length: up to 2 s, and up to 1.5 s before the last
moment for full braking. A policy that reads the time takes the beginning of the second part for that of the
level. The table has the shares of the threats that are recognised in time: the log odds of full braking
exceed a threshold while full braking still avoids the contact, and before the recorded driver brakes. Threats
in which the driver brakes earlier than 0.3 s before the last moment are left out. The thresholds are those
that 2 % of the levels without a threat exceed.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.agents.base import FPS, HOLD
from lgmd_gym.agents.policies.policy import Policy, action_values
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.statistics.intervals import Rate
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.dataset import policy_inputs
from lgmd_gym.training.offline.episodes import TRAFFIC, DrivenEpisode
from lgmd_gym.training.recordings import check_recordings, load_or_record
from lgmd_gym.training.trainer import CONFIG_FILE

FALSE_SHARE = 0.02
LATE_S = 0.3  # time to brake up to which the recorded driver must wait
CUT_S, LEFT_S = 2.0, 1.5  # longest part that is left out; time to brake that remains


class Judged(NamedTuple):
    """What a policy makes of a level."""

    threat: bool
    waits: bool  # whether the driver does not brake early
    odds: float  # highest log odds of full braking; of a threat, while it is in time


def without_start(episode: DrivenEpisode, rng: np.random.Generator, repeat: int) -> DrivenEpisode:
    """Return a level without a first part of random length, of whole decisions of the policy."""
    near = np.flatnonzero(episode.time_to_brake < LEFT_S)
    last = min(int(CUT_S * FPS), int(near[0]) if near.size else len(episode) - FPS)
    first = repeat * int(rng.integers(max(last, 0) // repeat + 1))
    return replace(
        episode,
        observations={name: values[first:] for name, values in episode.observations.items()},
        time_to_brake=episode.time_to_brake[first:],
        demands=episode.demands[first:],
    )


def judge(policy: Policy, episode: DrivenEpisode) -> Judged:
    """Return the result of one level."""
    features, brake = policy.features, policy.card.brake
    assert brake is not None
    (inputs,) = policy_inputs([episode.observations], features)
    logits = action_values(policy.network, inputs)
    assert logits is not None
    odds = brake.odds(logits)[:, brake.limits_s.index(brake.full_s)]
    braking = np.flatnonzero(episode.demands < HOLD)
    times = episode.time_to_brake[: braking[0] + 1 if braking.size else None]
    in_time = times[:: features.repeat] > 0.0
    highest = odds[: len(in_time)][in_time].max(initial=-np.inf)
    return Judged(episode.threat, bool((times <= LATE_S).any()), float(highest))


def recognised(levels: Sequence[Judged]) -> Rate:
    """Return the share of the threats that are recognised."""
    threshold = np.quantile([item.odds for item in levels if not item.threat], 1.0 - FALSE_SHARE)
    return Rate.of([item.odds > threshold for item in levels if item.threat and item.waits])


def main(arguments: Sequence[str] | None = None) -> dict[str, Rate]:
    """Print the table, and return its rates."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("policy", help="a policy of --algo time-to-brake: all-round, or a file")
    parser.add_argument("folder", type=Path, help="folder of lgmd-gym train")
    parser.add_argument("--seed", type=int, default=0, help="seed of the lengths")
    options = parser.parse_args(arguments)
    policy = Policy(options.policy)
    if policy.card.brake is None:
        raise ValueError(f"policy must be one of --algo time-to-brake, got {options.policy!r}")
    config = TrainConfig.from_dict(json.loads((options.folder / CONFIG_FILE).read_text()))
    config = replace(config, recordings=config.recordings or str(options.folder))
    check_recordings(config)
    rng = np.random.default_rng(options.seed)

    def levels() -> Iterator[DrivenEpisode]:
        episodes = load_or_record(config, "validation", options.folder)
        return (episode for episode in episodes if episode.family != TRAFFIC)

    repeat = policy.features.repeat
    found = {
        "as recorded": recognised([judge(policy, item) for item in levels()]),
        "without a first part": recognised(
            [judge(policy, without_start(item, rng, repeat)) for item in levels()]
        ),
    }
    print("| levels | recognised |\n|---|---:|")
    for name, rate in found.items():
        print(f"| {name} | {rate_text(rate)} |")
    return found


if __name__ == "__main__":
    main()
