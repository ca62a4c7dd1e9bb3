"""When do two rectangles touch? A swept separating-axis test, exact for straight relative motion.

highway-env tests the polygons after the step (and looks one step ahead), so it sees the contact speed up to
one step late and flags cars that stop a millimetre short. Here the first touch is found inside the step.
"""

from math import cos, hypot, inf, sin
from typing import NamedTuple


class Rectangle(NamedTuple):
    """A box seen from above, in highway-env's axes (y to the right of a car that heads along x)."""

    x: float  # centre [m]
    y: float  # centre [m]
    heading: float  # [rad]
    length: float  # [m]
    width: float  # [m]

    @property
    def reach(self) -> float:
        """From the centre to a corner [m]."""
        return hypot(self.length, self.width) / 2


def first_touch(moving: Rectangle, standing: Rectangle, dx: float, dy: float) -> float | None:
    """Return the fraction of the way at which `moving` first touches `standing`.

    Args:
        moving: The rectangle that is displaced, without turning.
        standing: The rectangle it may touch.
        dx: Displacement along x, relative to `standing` [m].
        dy: Displacement along y, relative to `standing` [m].

    Returns:
        A fraction in [0, 1], 0 if they overlap from the start, or None if they do not touch on the way.
    """
    apart_x, apart_y = standing.x - moving.x, standing.y - moving.y
    if hypot(apart_x, apart_y) > moving.reach + standing.reach + hypot(dx, dy):
        return None
    cos_a, sin_a = cos(moving.heading), sin(moving.heading)
    cos_b, sin_b = cos(standing.heading), sin(standing.heading)
    enter, leave = 0.0, 1.0
    for ax, ay in ((cos_a, sin_a), (-sin_a, cos_a), (cos_b, sin_b), (-sin_b, cos_b)):
        reach = 0.5 * (
            moving.length * abs(ax * cos_a + ay * sin_a)
            + moving.width * abs(ay * cos_a - ax * sin_a)
            + standing.length * abs(ax * cos_b + ay * sin_b)
            + standing.width * abs(ay * cos_b - ax * sin_b)
        )
        first, last = _overlap(ax * apart_x + ay * apart_y, ax * dx + ay * dy, reach)
        enter, leave = max(enter, first), min(leave, last)
        if enter > leave:
            return None
    return enter


def _overlap(apart: float, travel: float, reach: float) -> tuple[float, float]:
    """Return the fractions of the way between which |apart − fraction·travel| < reach."""
    if travel == 0.0:
        return (-inf, inf) if abs(apart) < reach else (inf, -inf)
    one, two = (apart - reach) / travel, (apart + reach) / travel
    return (one, two) if one < two else (two, one)
