# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""`OfflineDataset`: batches of recorded episodes in the form that a policy is trained on.

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

from lgmd_gym.agents.policies.features import (
    FRAME,
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
    NUM_SIDE_FIELDS,
    SIDE_COLUMNS,
)
from lgmd_gym.training.offline.episodes import Observation, RecordedEpisode

EPISODES_AT_ONCE = 16  # whose inputs are computed together
EVEN = ("ego_speed", "ego_acceleration", "known_deceleration", "zones", "zones_spikes", "zones_ffi")
"""Inputs that the mirror image does not change."""
EXCHANGED = ("columns", "sides_ffi")
"""Inputs of which the mirror image exchanges left and right."""


class EpisodeBatch(NamedTuple):
    """N episodes of at most T policy decisions, M decisions in total."""

    inputs: dict[str, torch.Tensor]  # policy inputs by name, (M, ...) each, frames with channels first
    indices: tuple[torch.Tensor, torch.Tensor]  # episode and decision of each row of `inputs`, (M,) each
    # rewards of holding the speed, (N, T); this and the next three are 0 after the episode's end
    rewards: torch.Tensor
    braking_returns: torch.Tensor  # returns of braking, (N, T)
    braking_contacts: torch.Tensor  # whether braking ends in a contact, bool (N, T)
    mask: torch.Tensor  # 1 at the decisions of the episode, (N, T)
    threats: torch.Tensor  # whether the episode without braking ends in a contact, bool (N,)


class OfflineDataset:
    """Recorded episodes with the inputs and the decision rate of a policy.

    It contains the inputs at each decision of the policy, those in `ZONE_INPUTS` as float16. Observations are
    not kept.

    Args:
        episodes: Recorded episodes, at least one; they are processed in groups.
        features: Inputs and timing of the policy.

    Attributes:
        episodes: The episodes without their observations.
    """

    def __init__(self, episodes: Iterable[RecordedEpisode], features: FeatureConfig) -> None:
        self.episodes: list[RecordedEpisode] = []
        self._features = features
        self._inputs: list[dict[str, np.ndarray]] = []  # of each episode
        remaining = iter(episodes)
        while group := list(islice(remaining, EPISODES_AT_ONCE)):
            # Batches add the history. Stored here, it would multiply the memory by its length.
            self._inputs += policy_inputs([episode.observations for episode in group], features)
            self.episodes += [replace(episode, observations={}) for episode in group]

    def __len__(self) -> int:
        return len(self.episodes)

    def batch(
        self, indices: Sequence[int] | np.ndarray, mirrored: Sequence[bool] | np.ndarray = ()
    ) -> EpisodeBatch:
        """Return the episodes with these indices.

        Args:
            indices: Indices of N episodes.
            mirrored: Whether each of them is mirrored, left to right, bool, (N,); empty for none.

        Raises:
            ValueError: If an episode is mirrored and an input has no known mirror image.
        """
        repeat = self._features.repeat
        episodes = [self.episodes[index] for index in indices]
        lengths = np.array([-(-len(episode) // repeat) for episode in episodes])
        rows = np.repeat(np.arange(len(episodes)), lengths)
        columns = np.concatenate([np.arange(length) for length in lengths])
        starts = (np.cumsum(lengths) - lengths)[rows]

        def padded(arrays: list[np.ndarray]) -> torch.Tensor:
            table = np.zeros((len(episodes), lengths.max()), arrays[0].dtype)
            table[rows, columns] = np.concatenate(arrays)
            return torch.from_numpy(table)

        return EpisodeBatch(
            inputs={
                name: self._with_history(name, self._arrays(name, indices, mirrored), columns, starts)
                for name in self._features.inputs
            },
            indices=(torch.from_numpy(rows), torch.from_numpy(columns)),
            rewards=padded([np.add.reduceat(item.rewards, range(0, len(item), repeat)) for item in episodes]),
            braking_returns=padded([item.braking_returns[::repeat] for item in episodes]),
            braking_contacts=padded([item.braking_contacts[::repeat] for item in episodes]),
            mask=padded([np.ones(length, np.float32) for length in lengths]),
            threats=torch.tensor([item.threat for item in episodes]),
        )

    def _arrays(
        self, name: str, indices: Sequence[int] | np.ndarray, mirrored: Sequence[bool] | np.ndarray
    ) -> list[np.ndarray]:
        """Return an input of some episodes, (decisions, ...) each."""
        arrays = [self._inputs[index][name] for index in indices]
        if not len(mirrored):
            return arrays
        return [
            mirror_input(name, array) if flag else array for array, flag in zip(arrays, mirrored, strict=True)
        ]

    def _with_history(
        self, name: str, arrays: list[np.ndarray], columns: np.ndarray, starts: np.ndarray
    ) -> torch.Tensor:
        """Return an input with its history, oldest first; the first decision fills missing ones.

        `columns` are the decisions of the rows, and `starts` the first rows of their episodes.
        """
        values = np.concatenate(arrays)
        length = self._features.history_of(name)
        if length > 1:
            rows = [starts + np.maximum(columns - lag, 0) for lag in range(length - 1, -1, -1)]
            values = np.concatenate([values[row] for row in rows], axis=-1)
        if name == FRAME:
            return torch.from_numpy(np.moveaxis(values, -1, 1).copy())
        return torch.from_numpy(values).float()


def policy_inputs(
    episodes: Sequence[Observation], features: FeatureConfig, zone_type: type[np.floating] = np.float16
) -> list[dict[str, np.ndarray]]:
    """Return the inputs of episodes at each decision of the policy, without a history, (decisions, ...) each.

    Args:
        episodes: Observations of each episode by name, (T, ...) each; frames are shrunk already.
        features: Inputs and timing of the policy.
        zone_type: Type of the inputs in `ZONE_INPUTS`; float16 rounds them to three digits.

    Raises:
        ValueError: If an observation is missing, or comes from other cameras than an input requires.
    """
    lengths = np.array([len(next(iter(observations.values()))) for observations in episodes])
    history = FeatureHistory(replace(features, history=1, shrink=1), len(episodes), zone_type)
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
            raise ValueError(f"mirror does not support the input {name!r}; set mirror to false")


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
    count = NUM_SIDE_FIELDS * len(NEURONS) * SIDE_COLUMNS
    sides = NUM_FORWARD_COLUMNS + np.arange(count).reshape(-1, 2, SIDE_COLUMNS)[:, ::-1, ::-1].ravel()
    signs = {neuron: -1.0 if neuron == "dsn" else 1.0 for neuron in (FORWARD_NEURON, *NEURONS)}
    parts = [np.full(NUM_FORWARD_COLUMNS, signs[FORWARD_NEURON])]
    parts += [np.full(count // len(NEURONS), signs[neuron]) for neuron in NEURONS]
    return Mirror(np.concatenate([forward, sides]), np.concatenate(parts).astype(np.float32))
