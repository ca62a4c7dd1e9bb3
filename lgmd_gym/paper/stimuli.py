"""The paper's synthetic stimuli: gratings, and squares or discs that loom, recede, pass or grow.

A scene is a background and, on it, an object; `frames` draws it as grey frames. Lengths are on a flat
screen, which `Screen` puts at a distance from the eye: the paper names no scale, and 1000 px/m is our
assumption (its 40, 60 and 80 units/m then have periods of 25, 17 and 12.5 px, its 10.8 cm/s are 6 px a
frame at 18 Hz). Everything is anti-aliased: an edge that moves by a tenth of a pixel changes the pixel by
a tenth.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.paper.backgrounds import SIZES, SPEED, Grating, Map, Panorama, Plain, Screen, natural

__all__ = [
    "SIZES", "SPEED", "Background", "Box", "Elongating", "Frame", "Grating", "Looming", "Object", "Panorama",
    "Plain", "Receding", "Screen", "Translating", "coverage", "frames", "natural",
]  # fmt: skip
Frame = NDArray[np.uint8]


class Background(Protocol):
    """What lies behind the object."""

    def paint(self, time: float, screen: Screen) -> Map:
        """Return luminance in 0-255 at a time [s], float64, shape (height, width)."""
        ...


class Box(NamedTuple):
    """Where an object is on the screen [px]: its centre, right and down of the screen's, and half sizes."""

    x: float
    y: float
    half_width: float
    half_height: float


class Object(Protocol):
    """What moves in front of the background."""

    @property
    def luminance(self) -> float:
        """In 0-255."""
        ...

    @property
    def outline(self) -> Literal["square", "disc"]:
        """Square or disc."""
        ...

    def box(self, time: float, screen: Screen) -> Box:
        """Return where it is at a time [s]."""
        ...


@dataclass(frozen=True, kw_only=True)
class Looming:
    """An object that comes straight on at constant speed; its angle is 2·atan(l/|v| / time to contact).

    Attributes:
        l_over_v: Half its size over its speed [s].
        contact: When it would touch the eye [s].
        largest: Half size at which it stops, seen from the eye [deg].
        luminance: In 0-255.
        outline: Square or disc.
    """

    l_over_v: float = 0.1
    contact: float = 3.0
    largest: float = 40.0
    luminance: float = 20.0
    outline: Literal["square", "disc"] = "square"

    def box(self, time: float, screen: Screen) -> Box:
        """Return where it is at a time [s]."""
        most = math.tan(math.radians(self.largest))
        left = self.contact - time
        half = screen.focal * (most if left * most <= self.l_over_v else self.l_over_v / left)
        return Box(0.0, 0.0, half, half)


@dataclass(frozen=True, kw_only=True)
class Receding(Looming):
    """An object that goes straight away at constant speed: looming, with time running backwards.

    Attributes:
        contact: When it was, or would have been, at the eye [s]; it stands still until it is as small as
            `largest`.
    """

    contact: float = 0.0

    def box(self, time: float, screen: Screen) -> Box:
        """Return where it is at a time [s]."""
        return Looming.box(self, 2.0 * self.contact - time, screen)


@dataclass(frozen=True, kw_only=True)
class Translating:
    """An object of constant size that passes from side to side.

    Attributes:
        half_size: On the screen [m].
        speed: On the screen [m/s], + to the right.
        centred: When it is in the middle [s].
        luminance: In 0-255.
        outline: Square or disc.
    """

    half_size: float = 0.04
    speed: float = SPEED
    centred: float = 2.0
    luminance: float = 20.0
    outline: Literal["square", "disc"] = "square"

    def box(self, time: float, screen: Screen) -> Box:
        """Return where it is at a time [s]."""
        half = self.half_size * screen.px_per_m
        return Box((time - self.centred) * self.speed * screen.px_per_m, 0.0, half, half)


@dataclass(frozen=True, kw_only=True)
class Elongating:
    """An object whose edges grow at constant linear speed on the screen, sideways or all round.

    Attributes:
        start: Half size at time 0 [m].
        speed: Of each edge [m/s].
        all_round: Whether it also grows up and down.
        luminance: In 0-255.
        outline: Square or disc.
    """

    start: float = 0.01
    speed: float = SPEED
    all_round: bool = True
    luminance: float = 20.0
    outline: Literal["square", "disc"] = "square"

    def box(self, time: float, screen: Screen) -> Box:
        """Return where it is at a time [s]."""
        half = (self.start + self.speed * time) * screen.px_per_m
        return Box(0.0, 0.0, half, half if self.all_round else self.start * screen.px_per_m)


def frames(
    screen: Screen, seconds: float, background: Background | None = None, thing: Object | None = None
) -> Iterator[Frame]:
    """Yield the grey frames of a scene: uint8, shape (height, width), row 0 at the top.

    Args:
        screen: Size, rate and scale.
        seconds: How long.
        background: None for plain grey.
        thing: The object in front; None for none.

    Example:
        >>> next(frames(Screen(shape=(4, 6)), 1.0, Grating(contrast=0.5))).shape
        (4, 6)
    """
    behind = Plain() if background is None else background
    for number in range(round(seconds * screen.fps)):
        time = number / screen.fps
        picture = behind.paint(time, screen)
        if thing is not None:
            picture = picture + coverage(thing.box(time, screen), thing.outline, screen.shape) * (
                thing.luminance - picture
            )
        yield np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def coverage(box: Box, outline: str, shape: tuple[int, int]) -> Map:
    """Return which part of each pixel an object covers, in [0, 1], shape (height, width)."""
    if outline == "square":
        across = _overlap(box.x, box.half_width, shape[1])
        return np.outer(_overlap(box.y, box.half_height, shape[0]), across)
    x, y = _centres(shape[1]) - box.x, _centres(shape[0]) - box.y
    half_width, half_height = max(box.half_width, 1e-9), max(box.half_height, 1e-9)
    reach = np.hypot(x[None, :] / half_width, y[:, None] / half_height)
    # Within half a pixel of the rim, the distance to it tells the part; a disc below a pixel keeps its area.
    part = np.clip((1.0 - reach) * min(half_width, half_height) + 0.5, 0.0, 1.0)
    area, drawn = math.pi * half_width * half_height, float(part.sum())
    scale = area / drawn if half_width < 1.0 and drawn > 0.0 else 1.0
    return np.asarray(part * scale, np.float64)


def _centres(size: int) -> Map:
    """Return the middles of the pixels along an axis, from the middle of the screen."""
    return np.arange(size, dtype=np.float64) + (0.5 - size / 2.0)


def _overlap(centre: float, half: float, size: int) -> Map:
    """Return how much of each pixel along an axis lies within centre ± half."""
    middle = _centres(size)
    return np.clip(
        np.minimum(middle + 0.5, centre + half) - np.maximum(middle - 0.5, centre - half), 0.0, 1.0
    )
