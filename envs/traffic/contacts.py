"""Compiled contacts of the cars of a traffic road, with the functions of `lgmd_gym.envs.dynamics`."""

from math import inf
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.bodies import outline_of
from lgmd_gym.envs.dynamics.contact import Rectangle, first_touch
from lgmd_gym.envs.dynamics.refined_contact import touch_between, uniform_touch
from lgmd_gym.kernels import kernel

MAX_APART = 8.0  # [m], sum of both coordinates beyond which two cars are not tested for a touch


@kernel(exact=True)
def outline_between(before: Any, after: Any, part: float) -> Rectangle:
    """Return the outline of a car after a part of the way from one `CAR` record to another."""
    rest = 1.0 - part
    x, y = rest * before.x + part * after.x, rest * before.y + part * after.y
    return Rectangle(x, y, rest * before.heading + part * after.heading, before.length, before.width)


@kernel(exact=True)
def find_contact(before: Any, after: Any, ego: int) -> Any:
    """Return which other car or object the ego touches first within a step, without turns and acceleration.

    Args:
        before: `CAR` records at the start of the step.
        after: The same records at its end.
        ego: Index of the ego.

    Returns:
        The index of the touched record; that of the ego without contact.
    """
    found, index = inf, ego
    for i in range(len(before)):
        if i == ego:
            continue
        fraction = uniform_touch(after[ego], after[i], before[ego], before[i])
        if fraction < found:
            found, index = fraction, i
    return index


@kernel(exact=True)
def contact_time(before: Any, after: Any, ego: int, other: int, shares: np.ndarray) -> float:
    """Return the time at which the ego touches another record, as a part of the step.

    Args:
        before: `CAR` records at the start of the step.
        after: The same records at its end.
        ego: Index of the ego.
        other: Index of the touched record.
        shares: Shares of its way that the ego has covered at equal times from start to end of the step.

    Returns:
        The time; `inf` if a turn within the step avoids the touch.
    """
    count = len(shares) - 1
    for k in range(count):
        a = outline_between(before[ego], after[ego], shares[k])
        b = outline_between(before[ego], after[ego], shares[k + 1])
        c = outline_between(before[other], after[other], k / count)
        d = outline_between(before[other], after[other], (k + 1) / count)
        touch = touch_between(a, b, c, d)
        if touch <= 1.0:
            return (k + touch) / count
    return inf


@kernel(exact=True)
def mark_collisions(cars: Any, number: int) -> None:
    """Mark the cars other than the ego that touch each other as crashed."""
    for i in range(number):
        for j in range(i):
            one, other = cars[i], cars[j]
            if one.is_ego or other.is_ego or abs(other.x - one.x) + abs(other.y - one.y) > MAX_APART:
                continue
            if first_touch(outline_of(one), outline_of(other), 0.0, 0.0) == 0.0:
                one.crashed = other.crashed = 1.0
