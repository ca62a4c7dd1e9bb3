"""Recorded levels as a reinforcement learning task without cameras.

With a latched brake, an episode without braking contains every observation that a policy can get before it
brakes, and the recording has the outcome of braking at each decision. `Decisions` is a table of them,
`RecordedLevels` a `VecEnv` that replays them.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv

from lgmd_gym.agents.policies.features import FRAME, FeatureConfig
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.episodes import RecordedEpisode, check_file, load
from lgmd_gym.training.recordings import FORMAT


class Decisions:
    """Decisions of recorded episodes in one table.

    Args:
        parts: Recorded episodes, in parts that are read one after the other.
        features: Inputs and timing of the policy.
        false_cost: Factor on the cost of braking without a threat.
    """

    def __init__(
        self, parts: Iterable[list[RecordedEpisode]], features: FeatureConfig, false_cost: float
    ) -> None:
        columns = [_columns(episodes, features) for episodes in parts]
        names = features.inputs
        self.inputs = {name: np.concatenate([part.pop(name) for part in columns]) for name in names}
        joined = {name: np.concatenate([part[name] for part in columns]) for name in columns[0]}
        self.starts = np.flatnonzero(joined["first"])
        self.last = np.append(joined["first"][1:], True)
        self.threats = joined["threat"][self.starts]
        self.hold, self.brake, self.contact = joined["hold"], joined["brake"], joined["contact"]
        remaining = np.concatenate([np.cumsum(part[::-1])[::-1] for part in self.split(self.hold)])
        self.cost = np.where(joined["threat"], self.brake, remaining + false_cost * (self.brake - remaining))

    def split(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the values of each episode."""
        return np.split(values, self.starts[1:])


def _columns(episodes: list[RecordedEpisode], features: FeatureConfig) -> dict[str, np.ndarray]:
    """Return the inputs, rewards and outcomes at each decision of the policy."""
    batch = OfflineDataset(episodes, features).batch(range(len(episodes)))
    rows, columns = (indices.numpy() for indices in batch.indices)
    return {
        **{name: values.numpy() for name, values in batch.inputs.items()},
        "first": columns == 0,
        "threat": batch.threats.numpy()[rows],
        "hold": batch.rewards.numpy()[rows, columns],
        "brake": batch.braking_returns.numpy()[rows, columns],
        "contact": batch.braking_contacts.numpy()[rows, columns],
    }


class RecordedLevels(VecEnv):
    """N environments that replay recorded episodes, in random order, until the policy brakes.

    Args:
        decisions: The recorded decisions.
        num_envs: Number of environments N.
        scale: Factor on the rewards.
        threat_share: Share of threats among the levels; None for that of the recordings.
    """

    def __init__(
        self, decisions: Decisions, num_envs: int, scale: float, threat_share: float | None = None
    ) -> None:
        boxes: dict[str, Any] = {name: _box(name, table) for name, table in decisions.inputs.items()}
        super().__init__(num_envs, spaces.Dict(boxes), spaces.Discrete(2))
        self._decisions, self._scale = decisions, scale
        self._rng = np.random.default_rng()
        threats, self._weights = decisions.threats, None
        if threat_share is not None:
            self._weights = np.where(
                threats, threat_share / threats.sum(), (1.0 - threat_share) / (~threats).sum()
            )

    def seed(self, seed: int | None = None) -> list[None]:
        self._rng = np.random.default_rng(seed)
        return [None] * self.num_envs

    def reset(self) -> dict[str, np.ndarray]:
        self._position = self._draw(self.num_envs)
        return self._observe()

    def _draw(self, count: int) -> np.ndarray:
        return self._rng.choice(self._decisions.starts, count, p=self._weights)

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
        self._position[ended] = self._draw(len(ended))
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


def _box(name: str, table: np.ndarray) -> spaces.Box:
    if name == FRAME:
        return spaces.Box(0, 255, table.shape[1:], np.uint8)
    return spaces.Box(-5.0, 5.0, table.shape[1:], np.float32)


def evaluate(model: Any, table: Decisions) -> np.ndarray:
    """Return the return, contact and braking of the deterministic policy in each level, shape (3, levels)."""
    wants = table.split(predict(model, table) == 1)
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


def predict(model: Any, table: Decisions, rows: int = 4096) -> np.ndarray:
    """Return the deterministic action at each decision; in parts, because frames fill the memory."""
    starts = range(0, len(table.hold), rows)
    parts = [{name: values[at : at + rows] for name, values in table.inputs.items()} for at in starts]
    return np.concatenate([model.predict(part, deterministic=True)[0] for part in parts])


def level_files(
    folder: Path, split: str, origin: dict[str, Any] | None = None
) -> Iterator[list[RecordedEpisode]]:
    """Yield the recorded levels of each file of a split.

    Args:
        folder: Folder of an offline training run.
        split: Folder of the recordings, such as "validation" or "extra1-validation".
        origin: Required settings of the recordings, such as {"camera": …}; None for any.

    Raises:
        SystemExit: If the folder has none.
        ValueError: If they have another format or other settings.
    """
    files = sorted((folder / "episodes" / split).glob("*.npz"))
    if not files:
        raise SystemExit(f"no recordings in {str(folder)!r}; record them with lgmd-gym train --algo offline")
    for file in files:
        check_file(file, {"format": FORMAT} | (origin or {}))
        yield [episode for by_seed in load(file) for episode in by_seed]
