"""Ablations of the training recipes, on recorded levels.

    lgmd-gym train --algo offline --sensors-of stopping-zone --inputs zones ego_speed ego_yaw_rate \
        --hyperparams zones.yml --n-timesteps 3000 --out runs/zones0
    python docs/experiments/rl_ablations.py runs/zones0 --seeds 5 --jobs 2

Each arm changes one property of the recipe of `lgmd-gym train`, and is trained on recorded levels (see
`recorded_levels.py`), which takes about a minute. All arms see the same number of camera frames;
`--budget` multiplies it. The offline method trains on nine of ten levels and selects its best epoch on the
others; `--levels` limits both. The table has results on the validation levels: interquartile means over
training seeds, with 95 % intervals of a bootstrap over seeds and levels for the return. It is in Markdown.

The arm on camera frames requires recordings of frames:

    lgmd-gym train --algo offline --inputs frame ego_speed ego_yaw_rate --hyperparams frames.yml \
        --n-timesteps 3000 --out runs/frames0
    python docs/experiments/rl_ablations.py runs/frames0 --arms frames --seeds 5
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
import torch
from joblib import Parallel, delayed
from recorded_levels import Decisions, RecordedLevels, evaluate, level_files

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.statistics.bootstrap import StratifiedBootstrap, interquartile_mean
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.learner import OfflineLearner
from lgmd_gym.training.online import algorithm_class, algorithm_kwargs

FALSE_COST = 10.0 / 6.0  # the recipes weight contacts with 6 in place of 10
OFFLINE = "offline"


@dataclass(frozen=True)
class Arm:
    """A recipe with changes.

    Attributes:
        title: First column of the table.
        algo: "dqn", "ppo" or "offline".
        features: Changes of the inputs and timing.
        algo_kwargs: Changes of the arguments of the algorithm.
        false_cost: Factor on the cost of braking without a threat.
        threat_share: Share of threats in training; None for that of the recordings, about a half.
    """

    title: str
    algo: str = "dqn"
    features: dict[str, Any] = field(default_factory=dict)
    algo_kwargs: dict[str, Any] = field(default_factory=dict)
    false_cost: float = FALSE_COST
    threat_share: float | None = None


SPEEDS = ("ego_speed", "ego_yaw_rate")
ARMS = {
    "recipe": Arm("recipe: DQN, 3.75 Hz, potentials"),
    "rate": Arm("7.5 Hz", features={"repeat": 4}),
    "reward": Arm("reward of the environment", false_cost=1.0),
    "exploration": Arm("exploration 0.3 in place of 0.03", algo_kwargs={"exploration_initial_eps": 0.3}),
    "scale": Arm("rewards not scaled", features={"reward_scale": 1.0}),
    "horizon": Arm("discount factor 0.9 per decision", algo_kwargs={"gamma": 0.9}),
    "few": Arm("25 % threats in training", threat_share=0.25),
    "many": Arm("75 % threats in training", threat_share=0.75),
    "memory": Arm("potentials of the last frame only", features={"inputs": ("membrane_potential", *SPEEDS)}),
    "ppo": Arm("PPO", "ppo"),
    "spikes": Arm("spike frequencies", features={"inputs": ("zones_spikes", *SPEEDS)}),
    "ffi": Arm("mean luminance change F̂", features={"inputs": ("zones_ffi", *SPEEDS)}),
    "speeds": Arm("speed and yaw rate only", features={"inputs": SPEEDS}),
    "frames": Arm(
        "camera frames, CNN",
        features={"inputs": ("frame", *SPEEDS), "history": 2},
        algo_kwargs={"learning_rate": 1e-4, "batch_size": 64, "buffer_size": 48_000},
    ),
    "offline": Arm("offline training, 15 Hz, potentials", OFFLINE, {"repeat": 2}),
}


def train_online(
    arm: Arm, seed: int, train: Decisions, validation: Decisions, budget: float = 1.0
) -> np.ndarray:
    """Train with stable-baselines3; return what `evaluate` returns for the validation levels."""
    torch.set_num_threads(1)
    config = TrainConfig.from_hyperparams(arm.algo)
    features = features_of(arm)
    envs = RecordedLevels(train, config.n_envs, features.reward_scale, arm.threat_share)
    envs.seed(seed)
    kwargs = algorithm_kwargs(config) | arm.algo_kwargs
    model = algorithm_class(arm.algo)(config.policy, envs, seed=seed, device="cpu", **kwargs)
    model.learn(round(budget * config.n_timesteps * config.features.repeat / features.repeat))
    return evaluate(model, validation)


def train_offline(arm: Arm, seed: int, folder: Path, levels: int | None) -> np.ndarray:
    """Train offline on the first levels; return what `evaluate` returns for the validation levels."""
    config, features = TrainConfig.from_hyperparams(OFFLINE), features_of(arm)
    episodes = list(islice(chain.from_iterable(level_files(folder, "train")), levels))
    split = len(episodes) * 9 // 10
    train, selection = (OfflineDataset(part, features) for part in (episodes[:split], episodes[split:]))
    validation = Decisions(level_files(folder, "validation"), features, 1.0)
    spaces = RecordedLevels(validation, 1, 1.0)  # only its spaces are used
    learner = OfflineLearner(config.policy, spaces, config.demands, seed=seed, **config.algo_kwargs)
    return evaluate(learner.learn(train, selection), validation)


def features_of(arm: Arm) -> FeatureConfig:
    """Return the inputs and timing of an arm."""
    return replace(TrainConfig.from_hyperparams("dqn").features, **arm.features)


def tasks_of(arm: Arm, folder: Path, seeds: int, levels: int | None, budget: float) -> Iterator[Any]:
    """Yield a delayed training for each seed; joblib shares the tables of the levels between processes."""
    if arm.algo == OFFLINE:
        yield from (delayed(train_offline)(arm, seed, folder, levels) for seed in range(seeds))
        return
    train = Decisions(level_files(folder, "train"), features_of(arm), arm.false_cost)
    validation = Decisions(level_files(folder, "validation"), features_of(arm), 1.0)
    yield from (delayed(train_online)(arm, seed, train, validation, budget) for seed in range(seeds))


def table_row(name: str, results: np.ndarray, threats: np.ndarray) -> str:
    """Return a Markdown row for results of shape (seeds, 3, levels)."""
    bootstrap = StratifiedBootstrap({f"{index:06d}": bool(threat) for index, threat in enumerate(threats)})
    low, high = np.percentile(interquartile_mean(bootstrap.means(results[:, 0], 0)), (2.5, 97.5))
    returns = results[:, 0].mean(1)
    avoided = 100.0 * (1.0 - results[:, 1][:, threats].mean(1))
    false = 100.0 * results[:, 2][:, ~threats].mean(1)
    return (
        f"| {name} | {interquartile_mean(returns):.2f} [{low:.2f}, {high:.2f}] "
        f"| {interquartile_mean(avoided):.0f} ({avoided.min():.0f}–{avoided.max():.0f}) "
        f"| {interquartile_mean(false):.0f} ({false.min():.0f}–{false.max():.0f}) |"
    )


def main(
    folder: Path,
    names: list[str],
    seeds: int = 5,
    jobs: int = 1,
    levels: int | None = None,
    budget: float = 1.0,
) -> None:
    """Train the arms and print the table."""
    episodes = chain.from_iterable(level_files(folder, "validation"))
    threats = np.array([episode.threat for episode in episodes])
    print(f"n = {seeds} seeds, {threats.sum()} threats and {(~threats).sum()} other validation levels\n")
    print("| arm | return | avoided [%] | false activations [%] |\n|---|---|---|---|")
    for name in names:
        results: Any = Parallel(n_jobs=jobs)(tasks_of(ARMS[name], folder, seeds, levels, budget))
        print(table_row(ARMS[name].title, np.stack(results), threats), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of an offline training run")
    parser.add_argument(
        "--arms", nargs="*", default=[name for name in ARMS if name != "frames"], choices=ARMS
    )
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--levels", type=int, help="number of training levels of the offline arm")
    parser.add_argument("--budget", type=float, default=1.0, help="factor on the number of decisions")
    options = parser.parse_args()
    main(options.folder, options.arms, options.seeds, options.jobs, options.levels, options.budget)
