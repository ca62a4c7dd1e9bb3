"""Synthetic stimuli: gratings, and squares or discs that loom, recede, translate or grow.

A stimulus is a background and an optional foreground object; `stimulus_frames` renders it as grey frames.
`stimulus_set` is the published set of named stimuli, those of the paper among them, each with the ground
truth of every frame; `lgmd_gym.paper.stimulus_files` writes them as videos.

Lengths are measured on a flat screen (`Screen`). The paper states no scale; 1000 px/m is an assumption. With
it, the paper's 40, 60 and 80 units/m have periods of 25, 17 and 12.5 px, and its 10.8 cm/s are 6 px per frame
at 18 Hz. Rendering is anti-aliased: an edge that moves by a tenth of a pixel changes the pixel by a tenth.
"""

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from lgmd_gym.paper.backgrounds import PAPER_SPEED, Grating, LuminanceMap, Panorama, Plain, Screen

Frame = NDArray[np.uint8]
Outline = Literal["square", "disc"]
DARK, LIGHT = 20.0, 235.0  # luminance of the objects in 0-255
# Added before rounding: a value that is half a grey level but for the last bits of a sine or a Fourier
# transform, which differ between machines, then gives the same pixel everywhere.
_ROUNDING = 1e-6


class Background(Protocol):
    """Background of a stimulus."""

    def render(self, time: float, screen: Screen) -> LuminanceMap:
        """Return luminance in 0-255 at a time [s], float64, shape (height, width)."""
        ...


class Truth(NamedTuple):
    """Ground truth of one frame of a stimulus."""

    time_s: float  # time since the first frame
    # motion of the object: approach, recede, translate, elongate or still; none without an object, outside if
    # it is beyond the sides of the screen
    label: str
    angular_size_deg: (
        float  # horizontal visual angle of the object, also beyond the screen; 0 without an object
    )
    # time to contact of an approaching object, negative after the contact of a receding one; None for others
    time_to_contact_s: float | None
    l_over_v_s: float | None  # half the size over the speed of such an object; None for others


class ScreenBox(NamedTuple):
    """Position of an object on the screen."""

    x: float  # centre, to the right of the screen's centre [px]
    y: float  # centre, below the screen's centre [px]
    half_width: float  # half the width [px]
    half_height: float  # half the height [px]


@dataclass(frozen=True, kw_only=True)
class ForegroundObject:
    """Moving object in front of the background."""

    luminance: float = DARK  # in 0-255
    outline: Outline = "square"  # outline of the object

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        raise NotImplementedError

    def label(self, time: float) -> str:
        """Return the motion at a time [s], see `Truth`."""
        raise NotImplementedError

    def truth(self, time: float, screen: Screen) -> Truth:
        """Return the ground truth at a time [s]."""
        box = self.box(time, screen)
        left, right = box.x - box.half_width, box.x + box.half_width
        outside = max(left, -right) >= screen.shape[1] / 2.0
        angle = math.atan(right / screen.focal) - math.atan(left / screen.focal)
        return Truth(time, "outside" if outside else self.label(time), math.degrees(angle), None, None)


@dataclass(frozen=True, kw_only=True)
class Looming(ForegroundObject):
    """An object that approaches at constant speed; its angle is 2·atan(l_over_v / time to contact)."""

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

    def label(self, time: float) -> str:
        """Return the motion at a time [s]: `approach` before the largest size, then `still`."""
        return "approach" if self._moves(self.contact - time) else "still"

    def truth(self, time: float, screen: Screen) -> Truth:
        """Return the ground truth at a time [s]."""
        truth = ForegroundObject.truth(self, time, screen)
        return truth._replace(time_to_contact_s=self.contact - time, l_over_v_s=self.l_over_v)

    def _moves(self, distance: float) -> bool:
        """Return whether the object is smaller than its largest size, at a time from contact [s]."""
        return distance * math.tan(math.radians(self.largest)) > self.l_over_v


@dataclass(frozen=True, kw_only=True)
class Receding(Looming):
    """An object that moves away from the eye at constant speed: `Looming` with reversed time."""

    # time at which the object is at the eye [s]. It is static until its angular half size falls below
    # `largest`
    contact: float = 0.0

    def box(self, time: float, screen: Screen) -> ScreenBox:
        """Return the position at a time [s]."""
        return Looming.box(self, 2.0 * self.contact - time, screen)

    def label(self, time: float) -> str:
        """Return the motion at a time [s]: `still` at the largest size, then `recede`."""
        return "recede" if self._moves(time - self.contact) else "still"

    def truth(self, time: float, screen: Screen) -> Truth:
        """Return the ground truth at a time [s]; the time to contact is undefined before the contact."""
        truth = Looming.truth(self, time, screen)
        return truth if time > self.contact else truth._replace(time_to_contact_s=None)


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

    def label(self, time: float) -> str:
        """Return the motion at a time [s]: `translate`."""
        return "translate"


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

    def label(self, time: float) -> str:
        """Return the motion at a time [s]: `elongate`."""
        return "elongate"


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
        yield np.clip(np.floor(picture + (0.5 + _ROUNDING)), 0, 255).astype(np.uint8)


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


SET_VERSION = 1  # of `stimulus_set`; a change of any frame or name needs a new version
SECONDS = 3.0  # duration of every stimulus of the set, and time of contact of its looming objects
SET_L_OVER_V = (0.01, 0.02, 0.05, 0.1, 0.2)  # of looming objects [s]
RECEDING_L_OVER_V = (0.05, 0.1, 0.2)  # of receding objects [s]
RECEDES_AT = 0.4  # time of contact of the receding objects [s]
SPEEDS = (PAPER_SPEED, 0.3)  # of translating and elongating objects [m/s]
SPATIAL = (40.0, 60.0, 80.0)  # spatial frequencies of the paper's gratings [periods/m]
TEMPORAL = (1.0, 2.0, 7.0)  # temporal frequencies of the gratings [Hz]
CONTRASTS = (0.2, 1.0)  # of the gratings behind looming squares, which drift at 2 Hz
_SHADES = {"dark": DARK, "light": LIGHT}
_OUTLINES: tuple[Outline, ...] = ("square", "disc")


@dataclass(frozen=True, kw_only=True)
class Stimulus:
    """A named stimulus of the set.

    Attributes:
        name: Name, unique in the set.
        background: Background.
        foreground: Moving object; None for none.
        seconds: Duration [s].
    """

    name: str
    background: Background
    foreground: ForegroundObject | None = None
    seconds: float = SECONDS

    def frames(self, screen: Screen) -> Iterator[Frame]:
        """Yield the grey frames, uint8, shape (height, width), row 0 at the top."""
        return stimulus_frames(screen, self.seconds, self.background, self.foreground)

    def truth(self, screen: Screen) -> list[Truth]:
        """Return the ground truth of each frame."""
        times = [number / screen.fps for number in range(round(self.seconds * screen.fps))]
        if self.foreground is None:
            return [Truth(time, "none", 0.0, None, None) for time in times]
        return [self.foreground.truth(time, screen) for time in times]

    def sha256(self, screen: Screen) -> str:
        """Return the SHA-256 of the raw video: the bytes of all frames in turn, row by row."""
        digest = hashlib.sha256()
        for frame in self.frames(screen):
            digest.update(frame.tobytes())
        return digest.hexdigest()


def stimulus_set(picture: str | Path | None = None) -> dict[str, Stimulus]:
    """Return the published stimuli by name: version `SET_VERSION` of the set.

    Names consist of the motion, the background, the outline and shade of the object, and a number with its
    unit. All objects are on a background of luminance 127.5 unless the name has another one.

    Args:
        picture: Image file for the panorama; None for the random image of the published set.

    Raises:
        ValueError: If the image file cannot be read.

    Example:
        >>> square = stimulus_set()["looming-square-dark-100ms"]
        >>> square.truth(Screen())[60]  # 1 s before contact
        Truth(time_s=2.0, label='approach', angular_size_deg=11.4..., time_to_contact_s=1.0, l_over_v_s=0.1)
    """
    plain = Plain()
    stimuli = [
        Stimulus(name=f"{name}-{1000 * item.l_over_v:.0f}ms", background=plain, foreground=item)
        for kind, values, contact in (
            (Looming, SET_L_OVER_V, SECONDS), (Receding, RECEDING_L_OVER_V, RECEDES_AT)
        )
        for name, item in _approaches(kind, values, contact)
    ]  # fmt: skip
    for (shade, luminance), speed in product(_SHADES.items(), SPEEDS):
        passing = Translating(luminance=luminance, speed=speed, centred=SECONDS / 2.0)
        name = f"translating-square-{shade}-{speed:g}mps"
        stimuli.append(Stimulus(name=name, background=plain, foreground=passing))
    for (shade, luminance), all_round in product(_SHADES.items(), (True, False)):
        growing = Elongating(luminance=luminance, speed=SPEEDS[0], all_round=all_round)
        name = f"elongating-{'square' if all_round else 'bar'}-{shade}-{SPEEDS[0]:g}mps"
        stimuli.append(Stimulus(name=name, background=plain, foreground=growing))
    for spatial, temporal in product(SPATIAL, TEMPORAL):
        grating = Grating(spatial=spatial, temporal=temporal)
        stimuli.append(Stimulus(name=f"grating-{spatial:g}-per-m-{temporal:g}hz", background=grating))
    for contrast, spatial, (shade, luminance) in product(CONTRASTS, SPATIAL, _SHADES.items()):
        grating = Grating(spatial=spatial, temporal=2.0, contrast=contrast)
        name = f"looming-in-grating-{spatial:g}-per-m-contrast-{contrast:g}-{shade}"
        square = Looming(luminance=luminance, contact=SECONDS)
        stimuli.append(Stimulus(name=name, background=grating, foreground=square))
    stimuli += _in_panorama(Panorama(picture=picture))
    return {stimulus.name: stimulus for stimulus in stimuli}


def _approaches(
    kind: type[Looming], l_over_v: tuple[float, ...], contact: float
) -> Iterator[tuple[str, Looming]]:
    """Yield dark and light squares and discs that approach or recede, each with the start of its name."""
    for outline, (shade, luminance), value in product(_OUTLINES, _SHADES.items(), l_over_v):
        item = kind(outline=outline, luminance=luminance, l_over_v=value, contact=contact)
        yield f"{kind.__name__.lower()}-{outline}-{shade}", item


def _in_panorama(panorama: Panorama) -> list[Stimulus]:
    """Return the panorama alone, and with squares that approach, recede and translate."""
    objects: dict[str, ForegroundObject | None] = {"panorama": None}
    for shade, luminance in _SHADES.items():
        objects |= {
            f"looming-in-panorama-{shade}": Looming(luminance=luminance, contact=SECONDS),
            f"receding-in-panorama-{shade}": Receding(luminance=luminance, contact=RECEDES_AT),
        }
        for speed in SPEEDS:
            passing = Translating(luminance=luminance, speed=speed, centred=SECONDS / 2.0)
            objects[f"translating-in-panorama-{shade}-{speed:g}mps"] = passing
    return [Stimulus(name=name, background=panorama, foreground=item) for name, item in objects.items()]
