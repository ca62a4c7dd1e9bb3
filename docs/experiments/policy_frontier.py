"""Avoided contacts and lead time of a policy against its false activations, on recorded validation episodes.

    python docs/experiments/policy_frontier.py runs/all-round policy:all-round

The folder is that of an offline training run with the cameras of the policy; the page on the design of
`policy:all-round` has the command of its training. A policy brakes when its log odds of braking exceed a
margin; 0 is the margin of the agent. A larger margin delays the braking and leaves more contacts. The lead
time is the median time from braking to the contact of the same episode without braking, over the threats in
which the policy brakes. Rates are k/n with Wilson intervals in per cent, over all validation episodes of the
training run, also those of `--extra-levels` and `--extra-traffic`. Traffic episodes are segments of at most
ten seconds, all without an emergency. The table is in Markdown.
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from json import dumps, loads
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import torch
from recorded_levels import level_files

from lgmd_gym.agents import make_agents
from lgmd_gym.agents.policies.policy import Policy
from lgmd_gym.sensing.channel import plain_values
from lgmd_gym.statistics.intervals import Rate
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.episodes import RecordedEpisode

MARGINS = (-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
HEAD = """| margin | avoided | lead time [s] | false activations, levels | false activations, traffic |
|---|---|---|---|---|"""


@torch.no_grad()
def log_odds(policy: Policy, episodes: Sequence[RecordedEpisode]) -> list[np.ndarray]:
    """Return the log odds of braking at each decision of the policy, one array per episode."""
    network: Any = policy.network
    if not hasattr(network, "get_distribution"):
        raise SystemExit(f"{policy.name} has no action probabilities; use a policy of PPO or --algo offline")
    demands = policy.card.demands
    if demands is None or len(demands) != 2 or policy.card.features is None:
        raise SystemExit(f"{policy.name} must have two demands and the inputs of PolicyWrapper")
    brake = int(np.argmin(demands))
    result = []
    for episode in episodes:
        batch = OfflineDataset([episode], policy.card.features).batch([0])
        logits = network.get_distribution(batch.inputs).distribution.logits
        result.append((logits[:, brake] - logits[:, 1 - brake]).numpy())
    return result


def first_braking(odds: np.ndarray, margin: float, repeat: int) -> int | None:
    """Return the first decision of the environment at which the policy brakes; None without one."""
    above = np.flatnonzero(odds > margin)
    return int(above[0]) * repeat if len(above) else None


def precise_text(rate: Rate) -> str:
    """Return k/n and its interval in per cent with one decimal, which the low rates in traffic require."""
    return f"{rate.k}/{rate.n} [{100 * rate.low:.1f}–{100 * rate.high:.1f}]" if rate.n else "–"


def frontier_row(
    margin: float, episodes: Sequence[RecordedEpisode], onsets: Sequence[int | None], rate_hz: float
) -> str:
    """Return the table row of a margin, for the first braking decision of each episode."""
    pairs = list(zip(episodes, onsets, strict=True))
    threats = [(episode, onset) for episode, onset in pairs if episode.threat]
    avoided = [onset is not None and not episode.braking_contacts[onset] for episode, onset in threats]
    leads = [(len(episode) - onset) / rate_hz for episode, onset in threats if onset is not None]
    others: dict[bool, list[bool]] = {False: [], True: []}
    for episode, onset in pairs:
        if not episode.threat:
            others[episode.traffic].append(onset is not None)
    rates = [precise_text(Rate.of(flags)) for flags in (avoided, others[False], others[True])]
    lead = f"{median(leads):.2f}" if leads else "–"
    return f"| {margin:g} | {rates[0]} | {lead} | {rates[1]} | {rates[2]} |"


def main(folder: Path, name: str, margins: Sequence[float] = MARGINS, rate_hz: float = 30.0) -> None:
    """Print the table of a policy."""
    policy = make_agents(name, 1)
    if not isinstance(policy, Policy):
        raise SystemExit(f"{name} is not a policy; use policy:NAME or policy:FILE.zip")
    sets = sorted(item.name for item in (folder / "episodes").glob("*validation"))
    # With other cameras the inputs of the policy may have the same shape and another meaning.
    origin = {"camera": loads(dumps(plain_values(policy.camera)))}
    parts = (part for name in sets or ["validation"] for part in level_files(folder, name, origin))
    episodes, odds = [], []
    for part in parts:
        odds += log_odds(policy, part)
        episodes += [replace(episode, observations={}) for episode in part]  # one file at a time in memory
    print(HEAD)
    for margin in margins:
        onsets = [first_braking(values, margin, policy.features.repeat) for values in odds]
        print(frontier_row(margin, episodes, onsets, rate_hz), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of an offline training run")
    parser.add_argument("policy", help="policy:NAME or policy:FILE.zip")
    parser.add_argument("--margins", type=float, nargs="+", default=MARGINS)
    parser.add_argument("--rate-hz", type=float, default=30.0, help="decisions of the environment per second")
    options = parser.parse_args()
    main(options.folder, options.policy, options.margins, options.rate_hz)
