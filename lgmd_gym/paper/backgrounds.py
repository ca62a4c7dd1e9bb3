"""Backgrounds of synthetic stimuli: uniform grey, gratings and a shifting panorama."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

LuminanceMap = NDArray[np.float64]  # luminance in 0-255, shape (height, width)
# Shapes of the paper's synthetic and real sequences, (height, width) [px].
SHAPES = {"gratings": (334, 380), "looming": (270, 540), "video": (288, 352)}
PAPER_SPEED = 0.108  # the paper's constant linear speed [m/s]


@dataclass(frozen=True, kw_only=True)
class Screen:
    """A flat screen in front of the eye."""

    shape: tuple[int, int] = SHAPES["looming"]  # (height, width) [px]
    fps: float = 30.0  # frame rate [Hz]
    px_per_m: float = 1000.0  # pixels per metre on the screen; an assumption, since the paper states none
    distance: float = 0.3  # distance between eye and screen [m]

    def __post_init__(self) -> None:
        if min(self.shape) < 1:
            raise ValueError(f"shape must be (height, width), each at least 1 px, got {self.shape}")
        for name in ("fps", "px_per_m", "distance"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ValueError(f"{name} must be > 0 and finite, got {value:g}")

    @property
    def focal(self) -> float:
        """Pixels on the screen per unit of the tangent of the visual angle."""
        return self.distance * self.px_per_m


@dataclass(frozen=True, kw_only=True)
class Plain:
    """A uniform background."""

    luminance: float = 127.5  # in 0-255

    def render(self, time: float, screen: Screen) -> LuminanceMap:
        """Return luminance in 0-255, shape (height, width)."""
        return np.full(screen.shape, self.luminance)


@dataclass(frozen=True, kw_only=True)
class Grating:
    """A drifting sinusoidal grating."""

    spatial: float = 40.0  # spatial frequency [periods/m]
    temporal: float = 2.0  # temporal frequency [Hz]
    contrast: float = 1.0  # michelson contrast in [0, 1]
    direction: float = 0.0  # direction of the drift [deg], 0 to the right, 90 upwards
    mean: float = 127.5  # mean luminance; contrast 1 around 127.5 spans 0-255

    def render(self, time: float, screen: Screen) -> LuminanceMap:
        """Return luminance in 0-255, shape (height, width), averaged over each pixel."""
        cycles = self.spatial / screen.px_per_m  # per px
        along_x = cycles * math.cos(math.radians(self.direction))
        along_y = -cycles * math.sin(math.radians(self.direction))  # row 0 is at the top
        height, width = screen.shape
        phase_x = 2.0 * math.pi * (along_x * np.arange(width) - self.temporal * time)
        phase_y = 2.0 * math.pi * along_y * np.arange(height)
        wave = np.outer(np.sin(phase_y), np.cos(phase_x)) + np.outer(np.cos(phase_y), np.sin(phase_x))
        attenuation = float(np.sinc(along_x) * np.sinc(along_y))  # of the mean over a pixel
        return self.mean * (1.0 + self.contrast * attenuation * wave)


class Panorama:
    """A periodic panorama that shifts sideways.

    Args:
        speed: Speed of the shift on the screen [m/s], + to the left, as for an eye that turns right.
        picture: Image file, or grey luminance in 0-255, shape (H, W); None for a random image with the 1/f
            amplitude spectrum of natural scenes.
        contrast: Standard deviation over mean of the random image.
        seed: Seed of the random image.
    """

    def __init__(
        self,
        *,
        speed: float = 0.05,
        picture: str | Path | LuminanceMap | None = None,
        contrast: float = 0.15,
        seed: int = 0,
    ) -> None:
        self.speed, self.contrast, self.seed = speed, contrast, seed
        self.picture = _load(picture) if isinstance(picture, str | Path) else picture
        self._panorama: LuminanceMap | None = None

    def render(self, time: float, screen: Screen) -> LuminanceMap:
        """Return luminance in 0-255, shape (height, width)."""
        height, width = screen.shape
        panorama = self._panorama
        if panorama is None or panorama.shape[0] != height or panorama.shape[1] < width:
            panorama = self._panorama = self._make_panorama(screen.shape)
        shift = self.speed * screen.px_per_m * time
        whole = math.floor(shift)
        view = panorama[:, (whole + np.arange(width + 1)) % panorama.shape[1]]
        part = shift - whole
        return (1.0 - part) * view[:, :-1] + part * view[:, 1:]

    def _make_panorama(self, shape: tuple[int, int]) -> LuminanceMap:
        """Return the whole panorama, at least twice as wide as the screen."""
        if self.picture is None:
            return natural_image((shape[0], 2 * shape[1]), self.contrast, self.seed)
        scaled = _scale(self.picture, shape)
        return np.hstack([scaled, scaled[:, ::-1]])  # the mirror image makes it continuous


def natural_image(shape: tuple[int, int], contrast: float = 0.15, seed: int = 0) -> LuminanceMap:
    """Return a random periodic image with the 1/f amplitude spectrum of natural scenes.

    Args:
        shape: (height, width) [px].
        contrast: Standard deviation over mean.
        seed: Seed of the phases.

    Returns:
        Luminance in 0-255 around 127.5, float64.
    """
    noise = np.fft.rfft2(np.random.default_rng(seed).standard_normal(shape))
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :])
    frequency[0, 0] = math.inf
    picture = np.fft.irfft2(noise / frequency, shape)
    return np.clip(127.5 * (1.0 + contrast * picture / max(float(picture.std()), 1e-12)), 0.0, 255.0)


def _load(path: str | Path) -> LuminanceMap:
    """Return an image file as grey luminance."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            return np.asarray(image.convert("L"), float)
    except UnidentifiedImageError:
        raise ValueError(f"picture {str(path)!r} is not an image that Pillow can read") from None
    except OSError as error:
        raise ValueError(f"picture {str(path)!r} cannot be read: {error.strerror or error}") from None


def _scale(picture: LuminanceMap, shape: tuple[int, int]) -> LuminanceMap:
    """Return an image scaled to the height of the screen and at least its width."""
    from PIL import Image

    scale = max(shape[0] / picture.shape[0], shape[1] / picture.shape[1])
    size = max(round(picture.shape[1] * scale), shape[1]), max(round(picture.shape[0] * scale), shape[0])
    image = Image.fromarray(picture.astype(np.float32)).resize(size, Image.Resampling.BILINEAR)
    return np.asarray(image, np.float64)[: shape[0]]
