"""A 360° panorama that replaces the skyline: natural noise or an image."""

import math
from functools import lru_cache
from pathlib import Path

import numpy as np

from lgmd_gym.camera.effects import WHITE, far_transmission, haze_grey, to_light
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.kernels import kernel

_MAX_LOG2 = 13  # maximum width 8192 px, 0.044° each
_ROWS = 128  # heights are multiples of this
_NIGHT = 0.035  # light of a night sky, as a share of daylight


def panorama_table(p: CameraParams) -> np.ndarray:
    """Return the panorama of a camera under its light and fog, at the resolution of its pixels.

    Columns run from the direction +x towards +y, texels are square, and the horizon is at half height.

    Returns:
        float32, shape (height, width), width a power of two; shape (0, 0) for the skyline.

    Raises:
        ValueError: If an image cannot be read.
    """
    if p.panorama == "skyline":
        return np.zeros((0, 0), dtype=np.float32)
    grey = natural_panorama(p.seed) if p.panorama == "natural" else _image(p.panorama)
    grey = grey.astype(np.float32)
    if p.linear_light:
        grey *= grey / np.float32(WHITE)
    # Halve the resolution while a pixel at the centre of the frame covers more than about 1.4 texels.
    while grey.shape[1] > 16 and 1.0 / p.focal_px > 1.4 * 2.0 * math.pi / grey.shape[1]:
        grey = 0.25 * (grey[0::2, 0::2] + grey[1::2, 0::2] + grey[0::2, 1::2] + grey[1::2, 1::2])
        if grey.shape[0] % 2:
            grey = np.concatenate((grey, grey[-1:]))
    if p.light == "night":
        grey *= _NIGHT
    if p.visibility_m > 0.0:
        haze = to_light(p, haze_grey(p))
        grey = haze + far_transmission(p) * (grey - haze)
    return np.ascontiguousarray(grey, dtype=np.float32)


@lru_cache(maxsize=2)
def natural_panorama(seed: int) -> np.ndarray:
    """Return noise with the statistics of natural scenes; uint8, shape (1024, 4096), 45° up and down.

    The amplitude falls as 1/frequency (Field 1987; Tolhurst et al. 1992 report exponents of 0.8 to 1.5). Grey
    is log-normal with a contrast (deviation over mean) of 0.4, and the sky is lighter than the ground.
    """
    rng = np.random.default_rng([seed, 6])
    shape = (1024, 4096)
    spectrum = np.fft.rfft2(rng.standard_normal((2 * shape[0], shape[1]), dtype=np.float32))
    fy = np.fft.fftfreq(2 * shape[0])[:, None] * 4096.0
    fx = np.fft.rfftfreq(shape[1])[None, :] * 4096.0
    spectrum *= 1.0 / np.sqrt(fx * fx + fy * fy + 4.0)
    spectrum[0, 0] = 0.0
    noise = np.fft.irfft2(spectrum, (2 * shape[0], shape[1]))[: shape[0]]
    noise /= noise.std()
    elevation = (0.5 * shape[0] - 0.5 - np.arange(shape[0])[:, None]) * 360.0 / shape[1]
    sky = 0.35 * np.tanh(elevation / 8.0)
    return np.clip(118.0 * np.exp(0.38 * noise + sky - 0.07), 0.0, 255.0).astype(np.uint8)


def _image(path: str) -> np.ndarray:
    try:
        stamp = Path(path).stat().st_mtime_ns
        return _read_image(path, stamp)
    except Exception as error:  # decoders raise many types of errors
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(
            f"camera panorama={path!r} cannot be read as an image ({reason}); "
            "pass the path of a PNG or JPEG, or 'skyline' or 'natural'"
        ) from error


@lru_cache(maxsize=4)
def _read_image(path: str, stamp: int) -> np.ndarray:
    """Read an image as grey, uint8; the width is a power of two and the height a multiple of 128."""
    from PIL import Image

    with Image.open(path) as image:
        grey = image.convert("L")
    wide = 1 << min(max(round(math.log2(grey.width)), 4), _MAX_LOG2)
    high = min(max(round(grey.height * wide / grey.width), 1), wide // 2 + _ROWS)
    pixels = np.asarray(grey.resize((wide, high), Image.Resampling.BOX))
    missing = -high % _ROWS
    return np.pad(pixels, ((missing // 2, missing - missing // 2), (0, 0)), mode="edge")


@kernel
def draw_panorama(image, lens, table, horizon):
    """Fill the rows above the horizon from a `panorama_table`."""
    height, width = image.shape
    f, c, s = lens.focal, lens.cos_pitch, lens.sin_pitch
    cr, sr = lens.cos_roll, lens.sin_roll
    rows = int(min(max(math.ceil(horizon.bottom), 0.0), height))
    high, wide = table.shape
    texels = wide / (2.0 * math.pi)
    for j in range(width):
        right = j + 0.5 - lens.centre_u
        u, turn = right, math.atan2(right, f * c)
        for i in range(rows):
            v = i + 0.5 - lens.centre_v
            if sr != 0.0:
                u, v = right * cr - v * sr, v * cr + right * sr
            ahead = f * c + v * s
            if s != 0.0 or sr != 0.0:
                turn = math.atan2(u, ahead)
            rise = math.atan2(f * s - v * c, math.sqrt(ahead * ahead + u * u))
            x = (lens.yaw + turn) * texels - 0.5
            y = min(max(0.5 * high - rise * texels - 0.5, 0.0), high - 1.0)
            left, top = math.floor(x), int(y)
            wx, wy = x - left, y - top
            a, b = int(left) & (wide - 1), (int(left) + 1) & (wide - 1)
            low = min(top + 1, high - 1)
            above = table[top, a] + wx * (table[top, b] - table[top, a])
            below = table[low, a] + wx * (table[low, b] - table[low, a])
            image[i, j] = above + wy * (below - above)
