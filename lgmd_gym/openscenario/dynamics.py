"""Transitions between two values: the shapes of OpenSCENARIO over a time, a distance, or with a rate."""

from dataclasses import dataclass
from math import cos, pi, sqrt

from lgmd_gym.openscenario.nodes import Element

_PEAKS = {"linear": 1.0, "sinusoidal": pi / 2, "cubic": 1.5}
"""Largest slope of each shape relative to the mean one."""
_BENDS = {"linear": 6.0, "sinusoidal": pi**2 / 2, "cubic": 6.0}
"""Largest second derivative of each shape; that of a linear one, which is infinite, as of a cubic one."""
SHAPES = ("step", *_PEAKS)
DIMENSIONS = ("time", "rate", "distance")


@dataclass(frozen=True)
class Dynamics:
    """A transition from one value to another."""

    item: Element  # element of the file
    shape: str  # step, linear, sinusoidal or cubic
    dimension: str  # time, rate or distance
    value: float  # duration [s], largest rate [unit/s] or distance [m]

    @property
    def is_step(self) -> bool:
        """Whether the value changes at once."""
        return self.shape == "step" or (self.value == 0.0 and self.dimension != "rate")

    def share(self, part: float) -> float:
        """Return the part of the change at a part of the time or distance, both in [0, 1]."""
        part = min(max(part, 0.0), 1.0)
        if self.shape == "sinusoidal":
            return (1.0 - cos(pi * part)) / 2.0
        return part * part * (3.0 - 2.0 * part) if self.shape == "cubic" else part

    def extent(self, change: float) -> float:
        """Return the duration [s], or the distance [m] of a transition over a distance.

        Args:
            change: Difference of the values; a rate is the largest one of the transition.
        """
        if self.dimension == "rate":
            return _PEAKS[self.shape] * abs(change) / self.value
        return self.value


def read_dynamics(item: Element, zero_rate: bool = False) -> Dynamics:
    """Return `TransitionDynamics`.

    Args:
        item: The element.
        zero_rate: Whether a rate of 0 is allowed, with which the change never ends.
    """
    shape = item.choice("dynamicsShape", SHAPES)
    dimension, value = item.choice("dynamicsDimension", DIMENSIONS), item.number("value")
    item.choice("followingMode", ("position",), "position")
    value = abs(value) if dimension == "rate" else value  # the sign follows from the values
    if dimension == "rate" and value == 0.0 and shape != "step" and not zero_rate:
        raise item.error(f"{item.tag} value must be > 0 for a rate, got 0; the change would never end")
    if value < 0.0:
        raise item.error(f"{item.tag} value must be >= 0, got {value:g}")
    return Dynamics(item, shape, dimension, value)


def read_offset_dynamics(item: Element, change: float) -> Dynamics:
    """Return `LaneOffsetActionDynamics`, whose duration follows from the largest lateral acceleration.

    Args:
        item: The element.
        change: Change of the offset [m].
    """
    shape = item.choice("dynamicsShape", SHAPES)
    if shape == "step" or not item.has("maxLateralAcc"):
        return Dynamics(item, "step", "time", 0.0)
    limit = item.number("maxLateralAcc")
    if limit <= 0.0:
        raise item.error(f"{item.tag} maxLateralAcc must be > 0 m/s², got {limit:g}")
    return Dynamics(item, shape, "time", sqrt(_BENDS[shape] * abs(change) / limit))
