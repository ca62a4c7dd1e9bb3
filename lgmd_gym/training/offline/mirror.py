"""Policy inputs of the mirrored world: left and right exchanged.

A level and its mirror image have the same outcomes. Mirrored inputs are therefore further training data, of
roads with traffic on the left.
"""

from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

import numpy as np

from lgmd_gym.agents.policies.features import NUM_LEVELS, ZONE_INPUTS
from lgmd_gym.agents.sides import (
    FORWARD_COLUMNS,
    NEURONS,
    NUM_FORWARD_COLUMNS,
    NUM_MOTION_FIELDS,
    NUM_SIDE_FIELDS,
    SIDE_COLUMNS,
)
from lgmd_gym.agents.zones import NUM_FIELDS

EVEN = ("ego_speed", "known_deceleration", "zones", "zones_spikes", "zones_ffi")
"""Inputs that the mirror image does not change."""
EXCHANGED = ("columns", "sides", "sides_ffi")
"""Inputs of which the mirror image exchanges left and right."""


class Mirror(NamedTuple):
    """Mirror image of an input x of one decision: ``x[order] * signs``.

    Attributes:
        order: Index of the element that takes each place, int64.
        signs: Sign of each element, float32.
    """

    order: np.ndarray
    signs: np.ndarray


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

    Args:
        name: Name of the input.
        size: Number of its elements per decision.

    Raises:
        ValueError: For an input without a known mirror image.
    """
    if name in EVEN:
        return Mirror(np.arange(size), np.ones(size, np.float32))
    if name == "ego_yaw_rate":
        return Mirror(np.arange(size), np.full(size, -1.0, np.float32))
    check_mirror([name])
    single = _columns() if name == "columns" else _fields(signed=name == "sides")
    count = len(single.order)
    assert size == NUM_LEVELS * count == ZONE_INPUTS[name].size
    order = (np.arange(NUM_LEVELS)[:, None] * count + single.order).ravel()
    return Mirror(order, np.tile(single.signs, NUM_LEVELS))


def _fields(signed: bool) -> Mirror:
    """Return the mirror image of one value per LGMD and DSN at the sides: left and right exchanged."""
    pairs = np.arange(NUM_MOTION_FIELDS - NUM_FIELDS).reshape(-1, 2)
    direction = [1.0, -1.0 if signed else 1.0]
    return Mirror(pairs[:, ::-1].ravel(), np.repeat(direction, NUM_SIDE_FIELDS).astype(np.float32))


def _columns() -> Mirror:
    """Return the mirror image of the columns; the signs of direction-selective neurons change."""
    forward = np.arange(NUM_FORWARD_COLUMNS).reshape(-1, FORWARD_COLUMNS)[:, ::-1].ravel()
    count = NUM_SIDE_FIELDS * len(NEURONS) * SIDE_COLUMNS
    sides = NUM_FORWARD_COLUMNS + np.arange(count).reshape(-1, 2, SIDE_COLUMNS)[:, ::-1, ::-1].ravel()
    direction = np.repeat([-1.0 if name == "dsn" else 1.0 for name in NEURONS], count // len(NEURONS))
    signs = np.concatenate([np.ones(NUM_FORWARD_COLUMNS), direction]).astype(np.float32)
    return Mirror(np.concatenate([forward, sides]), signs)
