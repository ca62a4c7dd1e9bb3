"""The paper's synthetic stimuli: gratings, and squares or discs that loom, recede, translate or grow.

A stimulus is a background and an optional foreground object; `stimulus_frames` renders it as grey frames.
Lengths are measured on a flat screen (`Screen`). The paper states no scale; 1000 px/m is an assumption. With
it, the paper's 40, 60 and 80 units/m have periods of 25, 17 and 12.5 px, and its 10.8 cm/s are 6 px per frame
at 18 Hz. Rendering is anti-aliased: an edge that moves by a tenth of a pixel changes the pixel by a tenth.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.paper.backgrounds import PAPER_SPEED, LuminanceMap, Plain, Screen

Frame = NDArray[np.uint8]


class Background(Protocol):
    """Background of a stimulus."""

    def render(self, time: float, screen: Screen) -> LuminanceMap:
        """Return luminance in 0-255 at a time [s], float64, shape (height, width)."""
        ...


class ScreenBox(NamedTuple):
    """Position of an object on the screen."""

    x: float  # centre, to the right of the screen's centre [px]
    y: float  # centre, below the screen's centre [px]
    half_width: float  # half the width [px]
    half_height: float  # half the height [px]


@dataclass(frozen=True, kw_only=True)
class ForegroundObject:
    """Moving object in front of the background."""

    luminance: float = 20.0  # in 0-255
    outline: Literal["square", "disc"] = "square"  # outline of the object

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Looming(ForegroundObject):
    """An object that approaches the eye at constant speed; its angle is 2·atan(l/|v| / time to contact)."""

    l_over_v: float = 0.1  # half its size over its speed [s]
    contact: float = 3.0  # time of contact with the eye [s]
    largest: float = 40.0  # angular half size at which it stops [deg]

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        largest = math.tan(math.radians(self.largest))
        remaining = self.contact - time
        tangent = largest if remaining * largest <= self.l_over_v else self.l_over_v / remaining
        half = screen.focal * tangent
        return ScreenBox(0.0, 0.0, half, half)


@dataclass(frozen=True, kw_only=True)
class Receding(Looming):
    """An object that moves away from the eye at constant speed: `Looming` with reversed time."""

    # time at which the object is at the eye [s]. It is static until its angular half size falls below
    # `largest`
    contact: float = 0.0

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        return Looming.box(self, 2.0 * self.contact - time, screen)


@dataclass(frozen=True, kw_only=True)
class Translating(ForegroundObject):
    """An object of constant size that moves sideways across the screen."""

    half_size: float = 0.04  # half its size on the screen [m]
    speed: float = PAPER_SPEED  # speed on the screen [m/s], + to the right
    centred: float = 2.0  # time at which it is at the centre of the screen [s]

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        half = self.half_size * screen.px_per_m
        return ScreenBox((time - self.centred) * self.speed * screen.px_per_m, 0.0, half, half)


@dataclass(frozen=True, kw_only=True)
class Elongating(ForegroundObject):
    """An object whose edges move outwards at constant speed on the screen."""

    start: float = 0.01  # half size at time 0 [m]
    speed: float = PAPER_SPEED  # speed of each edge [m/s]
    all_round: bool = True  # whether the upper and lower edges move as well

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        half = (self.start + self.speed * time) * screen.px_per_m
        return ScreenBox(0.0, 0.0, half, half if self.all_round else self.start * screen.px_per_m)


def stimulus_frames(
    screen: Screen,
    seconds: float,
    background: Background | None = None,
    foreground: ForegroundObject | None = None,
) -> Iterator[Frame]:
    """Yield the grey frames of a stimulus: uint8, shape (height, width), row 0 at the top.

    Args:
        screen: Size, frame rate and scale.
        seconds: Duration [s].
        background: Background; None for uniform grey.
        foreground: Moving object; None for none.

    Example:
        >>> next(stimulus_frames(Screen(shape=(4, 6)), 1.0, Plain(luminance=60.0))).shape
        (4, 6)
    """
    background = Plain() if background is None else background
    for number in range(round(seconds * screen.fps)):
        time = number / screen.fps
        picture = background.render(time, screen)
        if foreground is not None:
            covered = coverage(foreground.box(time, screen), foreground.outline, screen.shape)
            picture = picture + covered * (foreground.luminance - picture)
        yield np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def coverage(box: ScreenBox, outline: str, shape: tuple[int, int]) -> LuminanceMap:
    """Return the part of each pixel that an object covers, in [0, 1], shape (height, width)."""
    if outline == "square":
        columns = _overlap(box.x, box.half_width, shape[1])
        return np.outer(_overlap(box.y, box.half_height, shape[0]), columns)
    x, y = _centres(shape[1]) - box.x, _centres(shape[0]) - box.y
    half_width, half_height = max(box.half_width, 1e-9), max(box.half_height, 1e-9)
    reach = np.hypot(x[None, :] / half_width, y[:, None] / half_height)
    # Within half a pixel of the rim, the part is linear in the distance to the rim.
    part = np.clip((1.0 - reach) * min(half_width, half_height) + 0.5, 0.0, 1.0)
    # The area of a disc that is smaller than a pixel is corrected.
    area, rendered = math.pi * half_width * half_height, float(part.sum())
    scale = area / rendered if half_width < 1.0 and rendered > 0.0 else 1.0
    return np.asarray(part * scale, np.float64)


def _centres(size: int) -> LuminanceMap:
    """Return the pixel centres along an axis, relative to the centre of the screen."""
    return np.arange(size, dtype=np.float64) + (0.5 - size / 2.0)


def _overlap(centre: float, half: float, size: int) -> LuminanceMap:
    """Return the part of each pixel along an axis within centre ± half."""
    middle = _centres(size)
    return np.clip(
        np.minimum(middle + 0.5, centre + half) - np.maximum(middle - 0.5, centre - half), 0.0, 1.0
    )
