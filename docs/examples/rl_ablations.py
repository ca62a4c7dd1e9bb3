"""Ablations of the training recipes, on recorded levels.

    lgmd-gym train --algo offline --sensors-of stopping-zone --inputs zones ego_speed ego_yaw_rate \
        --hyperparams zones.yml --n-timesteps 3000 --out runs/zones0
    python docs/examples/rl_ablations.py runs/zones0 --seeds 5 --jobs 2

With a latched brake, an episode without braking contains every observation that a policy can get before it
brakes, and the recording has the outcome of braking at each decision. `RecordedLevels` replays recordings:
the same task without cameras, so that a training takes less than a minute. Each arm changes one property of
the recipe of `lgmd-gym train`. All arms see the same number of camera frames. The table has results on the
validation levels: interquartile means over training seeds, with 95 % intervals of a bootstrap over seeds and
levels for the return. It is in Markdown.
"""

import argparse
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from joblib import Parallel, delayed
from stable_baselines3.common.vec_env import VecEnv

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.benchmark.analysis.bootstrap import StratifiedBootstrap, interquartile_mean
from lgmd_gym.training import TrainConfig
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.episodes import RecordedEpisode
from lgmd_gym.training.offline.storage import load
from lgmd_gym.training.online import algorithm_class, algorithm_kwargs

FALSE_COST = 10.0 / 6.0  # the recipes weight contacts with 6 in place of 10


@dataclass(frozen=True)
class Arm:
    """A recipe with changes.

    Attributes:
        algo: "dqn" or "ppo".
        features: Changes of the inputs and timing.
        algo_kwargs: Changes of the arguments of the algorithm.
        false_cost: Factor on the cost of braking without a threat.
    """

    algo: str
    features: dict[str, Any] = field(default_factory=dict)
    algo_kwargs: dict[str, Any] = field(default_factory=dict)
    false_cost: float = FALSE_COST


SPEEDS = ("ego_speed", "ego_yaw_rate")
ARMS = {
    "recipe: DQN, 3.75 Hz, potentials": Arm("dqn"),
    "7.5 Hz": Arm("dqn", {"repeat": 4}),
    "reward of the environment": Arm("dqn", false_cost=1.0),
    "exploration 0.3 in place of 0.03": Arm("dqn", {}, {"exploration_initial_eps": 0.3}),
    "PPO": Arm("ppo"),
    "spike frequencies": Arm("dqn", {"inputs": ("zones_spikes", *SPEEDS)}),
    "mean luminance change F̂": Arm("dqn", {"inputs": ("zones_ffi", *SPEEDS)}),
    "speed and yaw rate only": Arm("dqn", {"inputs": SPEEDS}),
}


class Decisions:
    """Decisions of recorded episodes in one table.

    Args:
        episodes: Recorded episodes.
        features: Inputs and timing of the policy.
        false_cost: See `Arm`.
    """

    def __init__(self, episodes: list[RecordedEpisode], features: FeatureConfig, false_cost: float) -> None:
        batch = OfflineDataset(episodes, features).batch(range(len(episodes)))
        rows, columns = (indices.numpy() for indices in batch.indices)
        self.inputs = {name: values.numpy() for name, values in batch.inputs.items()}
        self.threats = batch.threats.numpy()
        self.starts = np.flatnonzero(columns == 0)
        self.last = np.append(columns[1:] == 0, True)
        self.hold = batch.rewards.numpy()[rows, columns]
        self.brake = batch.braking_returns.numpy()[rows, columns]
        self.contact = batch.braking_contacts.numpy()[rows, columns]
        remaining = np.concatenate([np.cumsum(part[::-1])[::-1] for part in self.split(self.hold)])
        self.cost = np.where(
            self.threats[rows], self.brake, remaining + false_cost * (self.brake - remaining)
        )

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the values of each episode."""
        return np.split(values, self.starts[1:])


class RecordedLevels(VecEnv):
    """N environments that replay recorded episodes, in random order, until the policy brakes.

    Args:
        decisions: The recorded decisions.
        num_envs: Number of environments N.
        scale: Factor on the rewards.
    """

    def __init__(self, decisions: Decisions, num_envs: int, scale: float) -> None:
        boxes: dict[str, Any] = {
            name: spaces.Box(-5.0, 5.0, values.shape[1:], np.float32)
            for name, values in decisions.inputs.items()
        }
        super().__init__(num_envs, spaces.Dict(boxes), spaces.Discrete(2))
        self._decisions, self._scale = decisions, scale
        self._rng = np.random.default_rng()

    def seed(self, seed: int | None = None) -> list[None]:
        self._rng = np.random.default_rng(seed)
        return [None] * self.num_envs

    def reset(self) -> dict[str, np.ndarray]:
        self._position = self._rng.choice(self._decisions.starts, self.num_envs)
        return self._observe()

    def step_async(self, actions: np.ndarray) -> None:
        self._actions = actions

    def step_wait(self) -> Any:
        table, braking = self._decisions, self._actions == 1
        rewards = np.where(braking, table.cost[self._position], table.hold[self._position])
        done = braking | table.last[self._position]
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        final, ended = self._observe(), np.flatnonzero(done)
        for index in ended:
            infos[index]["terminal_observation"] = {name: values[index] for name, values in final.items()}
        self._position = self._position + ~done
        self._position[ended] = self._rng.choice(table.starts, len(ended))
        return self._observe(), (self._scale * rewards).astype(np.float32), done, infos

    def _observe(self) -> dict[str, np.ndarray]:
        return {name: values[self._position] for name, values in self._decisions.inputs.items()}

    def close(self) -> None:
        pass

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [None] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise AttributeError(attr_name)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise AttributeError(method_name)

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


def train_arm(arm: Arm, seed: int, folder: Path, share: float = 1.0) -> np.ndarray:
    """Train an arm; return return, contact and braking in each validation level, shape (3, levels)."""
    torch.set_num_threads(1)
    config = TrainConfig.from_hyperparams(arm.algo)
    features = replace(config.features, **arm.features)
    table = read_decisions(folder, "train", features, arm.false_cost)
    envs = RecordedLevels(table, config.n_envs, features.reward_scale)
    envs.seed(seed)
    kwargs = algorithm_kwargs(config) | arm.algo_kwargs
    model = algorithm_class(arm.algo)(config.policy, envs, seed=seed, device="cpu", **kwargs)
    frames = share * config.n_timesteps * config.features.repeat
    model.learn(round(frames / features.repeat))
    return evaluate(model, read_decisions(folder, "validation", features, 1.0))


@lru_cache(maxsize=2)  # the training and validation levels of an arm
def read_decisions(folder: Path, split: str, features: FeatureConfig, false_cost: float) -> Decisions:
    """Return the decisions of the recorded levels of a split."""
    return Decisions(read_levels(folder, split), features, false_cost)


def evaluate(model: Any, table: Decisions) -> np.ndarray:
    """Return the return, contact and braking of the deterministic policy in each level, shape (3, levels)."""
    wants = table.split(model.predict(table.inputs, deterministic=True)[0] == 1)
    recorded = map(table.split, (table.hold, table.brake, table.contact))
    parts = zip(wants, *recorded, table.threats, strict=True)
    results = []
    for wanted, hold, brake, contact, threat in parts:
        onset = int(wanted.argmax())
        if wanted.any():
            results.append((hold[:onset].sum() + brake[onset], contact[onset], True))
        else:
            results.append((hold.sum(), threat, False))
    return np.array(results, np.float64).T


def read_levels(folder: Path, split: str) -> list[RecordedEpisode]:
    """Return the recorded levels of a split."""
    files = sorted((folder / "episodes" / split).glob("*.npz"))
    if not files:
        raise SystemExit(f"no recordings in {str(folder)!r}; record them with lgmd-gym train --algo offline")
    return [episode for file in files for by_seed in load(file) for episode in by_seed]


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


def main(folder: Path, arms: list[str], seeds: int = 5, jobs: int = 1, share: float = 1.0) -> None:
    """Train all arms and print the table."""
    levels = read_levels(folder, "validation")
    threats = np.array([episode.threat for episode in levels])
    print(f"n = {seeds} seeds, {threats.sum()} threats and {(~threats).sum()} other validation levels\n")
    print("| arm | return | avoided [%] | false activations [%] |\n|---|---|---|---|")
    for name in arms or ARMS:
        tasks = (delayed(train_arm)(ARMS[name], seed, folder, share) for seed in range(seeds))
        results: Any = Parallel(n_jobs=jobs)(tasks)
        print(table_row(name, np.stack(results), threats), flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of an offline training run")
    parser.add_argument("--arms", nargs="*", default=[], choices=list(ARMS))
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--jobs", type=int, default=1)
    options = parser.parse_args()
    main(options.folder, options.arms, options.seeds, options.jobs)
