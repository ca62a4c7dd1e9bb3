# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""`StateDataset`: the decisions of recorded episodes in the form that a policy is trained on.

A level and its mirror image, left and right exchanged, have the same outcomes. Mirrored inputs are therefore
further training data, of roads with traffic on the left.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from itertools import islice
from typing import NamedTuple

import numpy as np
import torch

from lgmd_gym.agents.base import HOLD
from lgmd_gym.agents.policies.features import (
    NUM_LEVELS,
    ZONE_INPUTS,
    FeatureConfig,
    FeatureHistory,
    source_observation,
)
from lgmd_gym.agents.sides import (
    FORWARD_COLUMNS,
    FORWARD_NEURON,
    NEURONS,
    NUM_FORWARD_COLUMNS,
    NUM_SIDE_CAMERAS,
    NUM_SIDE_FIELDS,
    SIDE_COLUMNS,
)
from lgmd_gym.training.offline.episodes import TRAFFIC, DrivenEpisode, Observation

EPISODES_AT_ONCE = 16  # whose inputs are computed together
EVEN = (
    *("ego_speed", "ego_acceleration", "known_deceleration", "speed_change"),
    *("zones", "zones_spikes", "zones_ffi"),
)
"""Inputs that the mirror image does not change."""
EXCHANGED = ("columns", "sides_ffi")
"""Inputs of which the mirror image exchanges left and right."""


class StateDataset:
    """The decisions of driven episodes: the inputs of a policy, and the interval of the time to brake.

    Args:
        episodes: Driven episodes, at least one; they are processed in groups.
        features: Inputs and timing of the policy, without frames and history.
        limits_s: Upper ends of the intervals of the time to brake [s].

    Attributes:
        names: Names of the inputs, in the order of the network: sorted.
        sizes: Number of features of each input.
        features: Inputs side by side, float16, (M, features).
        bounds: Index of the first decision of each episode, and M, int64, (episodes + 1,).
        times: Time to brake, float32, (M,) [s].
        classes: Index of its interval, int64, (M,).
        braking: Whether the agent braked before the decision, bool, (M,).
        in_traffic: Whether the episode is one of traffic, bool, (M,).
    """

    def __init__(
        self, episodes: Iterable[DrivenEpisode], features: FeatureConfig, limits_s: Sequence[float]
    ) -> None:
        self.names = sorted(features.inputs)
        rows = _Rows()
        times, demands, in_traffic = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
        self.sizes: list[int] = []
        remaining = iter(episodes)
        while group := list(islice(remaining, EPISODES_AT_ONCE)):
            for inputs in policy_inputs([episode.observations for episode in group], features):
                self.sizes = [inputs[name].shape[1] for name in self.names]
                parts = [inputs[name].astype(np.float16) for name in self.names]
                rows.append(np.concatenate(parts, axis=1))
            times += [episode.time_to_brake[:: features.repeat] for episode in group]
            before = [np.concatenate([[HOLD], episode.demands[:-1]]) for episode in group]
            demands += [values[:: features.repeat] for values in before]
            in_traffic += [
                np.full(-(-len(episode) // features.repeat), episode.family == TRAFFIC) for episode in group
            ]
        self.features = rows.array()
        self.bounds = np.cumsum([0, *map(len, times)])
        self.times = np.concatenate(times)
        self.classes = np.digitize(self.times, limits_s)
        self.braking = np.concatenate(demands) < HOLD
        self.in_traffic = np.concatenate(in_traffic)

    def __len__(self) -> int:
        return len(self.classes)

    def batch(self, indices: np.ndarray, mirrored: np.ndarray | None = None) -> torch.Tensor:
        """Return features, float32, (M, features).

        Args:
            indices: Indices of M decisions.
            mirrored: Whether each of them is mirrored, left to right, bool, (M,); None for none.
        """
        values = self.features[indices]
        if mirrored is not None:
            start = 0
            for name, size in zip(self.names, self.sizes, strict=True):
                part = values[mirrored, start : start + size]
                values[mirrored, start : start + size] = self.mirror(name, part)
                start += size
        return torch.from_numpy(values.astype(np.float32))

    def mirror(self, name: str, values: np.ndarray) -> np.ndarray:
        """Return the mirror image of an input at some decisions, new array, (M, elements)."""
        return mirror_input(name, values)


class _Rows:
    """Rows of an array that grows in place, so that few features are in memory twice."""

    def __init__(self) -> None:
        self._values, self._count = np.empty((0, 0)), 0

    def append(self, rows: np.ndarray) -> None:
        """Append rows, (N, columns)."""
        if not self._count:
            self._values = np.empty((0, rows.shape[1]), rows.dtype)
        end = self._count + len(rows)
        if end > len(self._values):
            # Linux moves large arrays without a copy.
            self._values.resize((max(end, len(self._values) * 9 // 8), rows.shape[1]), refcheck=False)
        self._values[self._count : end] = rows
        self._count = end

    def array(self) -> np.ndarray:
        """Return all rows; none can be appended any more."""
        self._values.resize((self._count, self._values.shape[1]), refcheck=False)
        return self._values


def policy_inputs(episodes: Sequence[Observation], features: FeatureConfig) -> list[dict[str, np.ndarray]]:
    """Return the inputs of episodes at each decision of the policy, without a history, (decisions, ...) each.

    Inputs in `ZONE_INPUTS` are rounded to float16, three digits.

    Args:
        episodes: Observations of each episode by name, (T, ...) each; frames are shrunk already.
        features: Inputs and timing of the policy.

    Raises:
        ValueError: If an observation is missing, or comes from other cameras than an input requires.
    """
    lengths = np.array([len(next(iter(observations.values()))) for observations in episodes])
    history = FeatureHistory(replace(features, history=1, shrink=1), len(episodes), np.float16)
    names = {source_observation(name) for name in features.inputs} & set(episodes[0])
    padded = {name: _padded([item[name] for item in episodes]) for name in names}
    tables: dict[str, np.ndarray] = {}
    for time in range(lengths.max()):
        running = np.flatnonzero(lengths > time)
        history.update({name: values[:, time] for name, values in padded.items()}, running)
        if time % features.repeat == 0:
            for name, values in history.stack(running).items():
                if name not in tables:
                    shape = len(episodes), -(-lengths.max() // features.repeat), *values.shape[1:]
                    tables[name] = np.zeros(shape, values.dtype)
                tables[name][running, time // features.repeat] = values
    decisions = (-(-lengths // features.repeat)).tolist()
    return [
        {name: table[index, :count].copy() for name, table in tables.items()}
        for index, count in enumerate(decisions)
    ]


def _padded(arrays: list[np.ndarray]) -> np.ndarray:
    """Return arrays of different lengths as one, (N, longest, ...), with zeros at their ends."""
    table = np.zeros((len(arrays), max(map(len, arrays)), *arrays[0].shape[1:]), arrays[0].dtype)
    for row, values in zip(table, arrays, strict=True):
        row[: len(values)] = values
    return table


class Mirror(NamedTuple):
    """Mirror image of an input x of one decision: ``x[order] * signs``."""

    order: np.ndarray  # index of the element that takes each place, int64
    signs: np.ndarray  # sign of each element, float32


def mirror_input(name: str, values: np.ndarray) -> np.ndarray:
    """Return the mirror image of a policy input at each decision, new array, (decisions, elements).

    Raises:
        ValueError: For an input without a known mirror image.
    """
    order, signs = mirror_of(name, values.shape[1])
    image = values[:, order]
    negative = signs < 0.0
    image[:, negative] = -image[:, negative]
    return image


def check_mirror(names: Iterable[str]) -> None:
    """Raise ValueError for an input without a known mirror image."""
    for name in names:
        if name not in (*EVEN, *EXCHANGED, "ego_yaw_rate"):
            raise ValueError(
                f"mirror does not support the input {name!r}; set mirror: false in the file of --hyperparams"
            )


@cache
def mirror_of(name: str, size: int) -> Mirror:
    """Return the mirror image of a policy input.

    Raises:
        ValueError: For an input without a known mirror image.
    """
    if name in EVEN:
        return Mirror(np.arange(size), np.ones(size, np.float32))
    if name == "ego_yaw_rate":
        return Mirror(np.arange(size), np.full(size, -1.0, np.float32))
    check_mirror([name])
    single = _columns() if name == "columns" else _fields()
    count = len(single.order)
    assert size == NUM_LEVELS * count == ZONE_INPUTS[name].size
    order = (np.arange(NUM_LEVELS)[:, None] * count + single.order).ravel()
    return Mirror(order, np.tile(single.signs, NUM_LEVELS))


def _fields() -> Mirror:
    """Return the mirror image of one strength per DSN at the sides: left and right exchanged."""
    pairs = np.arange(NUM_SIDE_FIELDS).reshape(-1, 2)
    return Mirror(pairs[:, ::-1].ravel(), np.ones(NUM_SIDE_FIELDS, np.float32))


def _columns() -> Mirror:
    """Return the mirror image of the columns; the signs of direction-selective neurons change."""
    forward = np.arange(NUM_FORWARD_COLUMNS).reshape(-1, FORWARD_COLUMNS)[:, ::-1].ravel()
    count = NUM_SIDE_CAMERAS * SIDE_COLUMNS
    sides = NUM_FORWARD_COLUMNS + np.arange(count).reshape(-1, 2, SIDE_COLUMNS)[:, ::-1, ::-1].ravel()
    signs = {neuron: -1.0 if neuron == "dsn" else 1.0 for neuron in (FORWARD_NEURON, *NEURONS)}
    parts = [np.full(NUM_FORWARD_COLUMNS, signs[FORWARD_NEURON])]
    parts += [np.full(count // len(NEURONS), signs[neuron]) for neuron in NEURONS]
    return Mirror(np.concatenate([forward, sides]), np.concatenate(parts).astype(np.float32))
