"""What lies behind the object of a synthetic stimulus: plain grey, gratings, a shifting panorama."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

Map = NDArray[np.float64]
# The sizes of the paper's synthetic and real sequences, (height, width) [px].
SIZES = {"gratings": (334, 380), "looming": (270, 540), "video": (288, 352)}
SPEED = 0.108  # the paper's constant linear speed [m/s]


@dataclass(frozen=True, kw_only=True)
class Screen:
    """A flat screen in front of the eye.

    Attributes:
        shape: (height, width) [px].
        fps: Frames per second [Hz].
        px_per_m: Pixels per metre on the screen; an assumption, the paper names none.
        distance: From the eye to the screen [m].
    """

    shape: tuple[int, int] = SIZES["looming"]
    fps: float = 30.0
    px_per_m: float = 1000.0
    distance: float = 0.3

    def __post_init__(self) -> None:
        if min(self.shape) < 1:
            raise ValueError(f"shape {self.shape} holds no pixel")
        for name in ("fps", "px_per_m", "distance"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} = {value:g} must be > 0 and finite")

    @property
    def focal(self) -> float:
        """Pixels on the screen per unit of the tangent of the visual angle."""
        return self.distance * self.px_per_m


@dataclass(frozen=True, kw_only=True)
class Plain:
    """A background of one luminance in 0-255."""

    luminance: float = 127.5

    def paint(self, time: float, screen: Screen) -> Map:
        """Return luminance in 0-255, shape (height, width)."""
        return np.full(screen.shape, self.luminance)


@dataclass(frozen=True, kw_only=True)
class Grating:
    """A drifting sinusoidal grating.

    Attributes:
        spatial: Spatial frequency [periods/m].
        temporal: Temporal frequency [Hz].
        contrast: Michelson's, in [0, 1].
        direction: In which it drifts [deg], 0 to the right, 90 up.
        mean: Mean luminance; contrast 1 around 127.5 spans 0-255.
    """

    spatial: float = 40.0
    temporal: float = 2.0
    contrast: float = 1.0
    direction: float = 0.0
    mean: float = 127.5

    def paint(self, time: float, screen: Screen) -> Map:
        """Return luminance in 0-255, shape (height, width), averaged over each pixel."""
        cycles = self.spatial / screen.px_per_m  # per px
        along_x = cycles * math.cos(math.radians(self.direction))
        along_y = -cycles * math.sin(math.radians(self.direction))  # rows run down
        height, width = screen.shape
        phase_x = 2.0 * math.pi * (along_x * np.arange(width) - self.temporal * time)
        phase_y = 2.0 * math.pi * along_y * np.arange(height)
        wave = np.outer(np.sin(phase_y), np.cos(phase_x)) + np.outer(np.cos(phase_y), np.sin(phase_x))
        blur = float(np.sinc(along_x) * np.sinc(along_y))  # the mean over the pixel's square
        return self.mean * (1.0 + self.contrast * blur * wave)


class Panorama:
    """A panorama that shifts sideways past the eye and comes round again.

    Args:
        speed: Of the shift [m/s on the screen], + to the left, as when the eye turns right.
        picture: A picture file, or grey luminance in 0-255, shape (H, W); None draws a random one with the
            1/f amplitude spectrum of natural scenes.
        contrast: Standard deviation over mean of the random picture.
        seed: Of the random picture.
    """

    def __init__(
        self,
        *,
        speed: float = 0.05,
        picture: str | Path | Map | None = None,
        contrast: float = 0.15,
        seed: int = 0,
    ) -> None:
        self.speed, self.contrast, self.seed = speed, contrast, seed
        self.picture = _load(picture) if isinstance(picture, str | Path) else picture
        self._drawn: Map | None = None

    def paint(self, time: float, screen: Screen) -> Map:
        """Return luminance in 0-255, shape (height, width)."""
        height, width = screen.shape
        if self._drawn is None or self._drawn.shape[0] != height or self._drawn.shape[1] < width:
            self._drawn = self._draw(screen.shape)
        shift = self.speed * screen.px_per_m * time
        whole = math.floor(shift)
        columns = (whole + np.arange(width + 1)) % self._drawn.shape[1]
        seen = self._drawn[:, columns]
        part = shift - whole
        return (1.0 - part) * seen[:, :-1] + part * seen[:, 1:]

    def _draw(self, shape: tuple[int, int]) -> Map:
        """Return the whole panorama, at least twice as wide as the screen."""
        if self.picture is None:
            return natural((shape[0], 2 * shape[1]), self.contrast, self.seed)
        scaled = _scaled(self.picture, shape)
        return np.hstack([scaled, scaled[:, ::-1]])  # mirrored, so that it has no seam


def natural(shape: tuple[int, int], contrast: float = 0.15, seed: int = 0) -> Map:
    """Return a random picture with the 1/f amplitude spectrum of natural scenes, without a seam.

    Args:
        shape: (height, width) [px].
        contrast: Standard deviation over mean.
        seed: Of the phases.

    Returns:
        Luminance in 0-255 around 127.5, float64.
    """
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal(shape))
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :])
    frequency[0, 0] = math.inf
    picture = np.fft.irfft2(noise / frequency, shape)
    return np.clip(127.5 * (1.0 + contrast * picture / max(float(picture.std()), 1e-12)), 0.0, 255.0)


def _load(path: str | Path) -> Map:
    """Return a picture file as grey luminance."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            return np.asarray(image.convert("L"), float)
    except UnidentifiedImageError:
        raise ValueError(f"picture {str(path)!r} is no picture that pillow can read") from None
    except OSError as error:
        raise ValueError(f"picture {str(path)!r} cannot be read: {error.strerror or error}") from None


def _scaled(picture: Map, shape: tuple[int, int]) -> Map:
    """Return a picture scaled to a height, and wide enough for the screen."""
    from PIL import Image

    scale = max(shape[0] / picture.shape[0], shape[1] / picture.shape[1])
    size = max(round(picture.shape[1] * scale), shape[1]), max(round(picture.shape[0] * scale), shape[0])
    image = Image.fromarray(picture.astype(np.float32)).resize(size, Image.Resampling.BILINEAR)
    return cast(Map, np.asarray(image, np.float64))[: shape[0]]
