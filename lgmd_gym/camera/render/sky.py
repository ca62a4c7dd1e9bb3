# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""Sky above the horizon: gradient and skyline, or a panorama."""

import math
from functools import lru_cache
from pathlib import Path

import numba as nb
import numpy as np

from lgmd_gym.camera.camera import Camera
from lgmd_gym.camera.effects import WHITE, far_transmission, haze_grey, to_light
from lgmd_gym.camera.scene import SKYLINE, Scene, Weather
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import (
    LANES,
    any_above,
    as_floats,
    lane_numbers,
    load_part,
    madd,
    maximum,
    minimum,
    splat,
    store_part,
)

_LOG2 = 15  # 0.011° per entry, finer than a pixel of a 5° lens at 160 px
_HILLS, _TREES, _LEAVES = 0, 1, 2
_DEPTH = 3
"""Rows of the outlines: heights of hills and trees above the horizon [px] and the grey of the trees. From
`_DEPTH` on, 1 / (height + 1) of hills and trees."""


@lru_cache(maxsize=40)
def skyline(seed: int) -> np.ndarray:
    """Return the skyline over 360°, natural 1/f^k profiles periodic in azimuth; float32, shape (3, 32768).

    Rows: elevation of the hills and of the tree line (tangent of the angle), grey of the trees (in standard
    deviations).
    """
    rng = np.random.default_rng([seed, 3])
    n = 1 << _LOG2
    hills = _profile(rng, n, exponent=1.6, lowest=3)
    trees = _profile(rng, n, exponent=0.95, lowest=12)
    leaves = _profile(rng, n, exponent=0.7, lowest=60)
    out = np.empty((3, n), dtype=np.float32)
    out[_HILLS] = np.clip(0.012 + 0.010 * hills, 0.0, 0.05)
    out[_TREES] = np.clip(0.011 + 0.009 * trees, 0.002, 0.05)
    out[_LEAVES] = leaves
    return out


def _profile(rng: np.random.Generator, n: int, exponent: float, lowest: int) -> np.ndarray:
    """Return periodic noise, 1/frequency^exponent above `lowest` waves per turn; unit variance."""
    frequency = np.maximum(np.arange(n // 2 + 1), lowest).astype(np.float64)
    spectrum = np.fft.rfft(rng.standard_normal(n)) * frequency**-exponent
    spectrum[0] = 0.0
    # Details under 0.05° are left out: no lens here resolves them.
    spectrum *= np.exp(-((np.arange(n // 2 + 1) / 7000.0) ** 2))
    profile = np.fft.irfft(spectrum, n)
    return profile / profile.std()


@kernel
def _arctan(x):
    """Return atan(x) to 1e-15, as in the Cephes library: without calls, so that loops become vectors."""
    size = abs(x)
    far, middle = size > 2.414213562373095, size > 0.66
    above = -1.0 if far else size - 1.0 if middle else size
    below = size if far else size + 1.0 if middle else 1.0
    t = above / below
    start = 0.5 * math.pi if far else 0.25 * math.pi if middle else 0.0
    z = t * t
    p = -8.750608600031904122785e-1 * z - 1.615753718733365076637e1
    p = (p * z - 7.500855792314704667340e1) * z - 1.228866684490136173410e2
    p = (p * z - 6.485021904942025371773e1) * z
    q = (z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2
    q = ((q * z + 4.328810604912902668951e2) * z + 4.853903996359136964868e2) * z + 1.945506571482613964425e2
    return math.copysign(start + (t + t * p / q), x)


@kernel
def _trace_outlines(lens, line, look, horizon, buffers):
    """Write the skyline in each column to `buffers.outlines`; see `_DEPTH`.

    The skyline of a lens that rolls is sheared instead of turned: it is shifted by up to the sine of the roll
    times its height, 0.06 px in `wide` and 0.4 px in `fovea` at 0.5°.
    """
    azimuths, distances = buffers.directions[0], buffers.directions[1]
    out, n = buffers.outlines, line.shape[1]
    width, f, c, s = out.shape[1], lens.focal, lens.cos_pitch, lens.sin_pitch
    # Loops become vectors only if they read no record.
    roll, yaw = lens.cos_roll, lens.yaw
    # The horizon in column j, as for a lens without roll, is at start + step·j.
    step = lens.cos_roll - horizon.slope * lens.sin_roll
    start = 0.5 * step - lens.centre_u * lens.cos_roll - (horizon.left - lens.centre_v) * lens.sin_roll
    narrow = 1.0 / (f * c)
    for j in range(width):
        u = start + step * j
        azimuths[j] = _arctan(u * narrow)
        distances[j] = math.sqrt(f * f + u * u)
    trees, leaf_gain = look.trees, look.leaf_gain
    turn = n / (2.0 * math.pi)
    for j in range(width):
        at = (yaw + azimuths[j]) * turn
        cell = math.floor(at)
        w = at - cell
        a, b = int(cell) & (n - 1), (int(cell) + 1) & (n - 1)
        for layer in range(2):
            scale = look.hill_scale if layer == _HILLS else look.tree_scale
            rise = scale * distances[j] * (line[layer, a] + w * (line[layer, b] - line[layer, a]))
            # Rows between the horizon and this elevation: the quotient of these.
            out[layer, j] = nb.float32(f * rise * roll)
            out[layer + _DEPTH, j] = nb.float32(c * (f * c + rise * s))
        leaf = line[_LEAVES, a] + w * (line[_LEAVES, b] - line[_LEAVES, a])
        out[_LEAVES, j] = nb.float32(trees + leaf_gain * leaf)
    one = splat(nb.float32(1.0))
    for layer in range(2):
        for j in range(0, width, LANES):
            at, below, count = layer * width + j, (layer + _DEPTH) * width + j, width - j
            height = load_part(out, at, count) / load_part(out, below, count)
            store_part(out, at, count, height)
            store_part(out, below, count, one / (height + one))


@kernel
def _gradient(look, horizon, row, width, focal):
    """Return the grey of the sky in the middle of a row, and its change per column, to first order."""
    # Elevation of the row in the middle of the frame; the gradient ends at 40°.
    up = (horizon.left + 0.5 * width * horizon.slope - (row + 0.5)) / focal
    if horizon.slope == 0.0:
        up = max(up, 0.0)
    rest, gain = math.exp(-3.0 * up), look.zenith - look.horizon
    grey = look.horizon + gain * (1.0 - rest)
    return grey, 3.0 * gain * rest * horizon.slope / focal


@kernel
def draw_sky(image, lens, line, look, horizon, buffers):
    """Fill the rows above the horizon.

    Args:
        image: Light, float32, shape (height, width).
        lens: The lens.
        line: `skyline(seed)`.
        look: Greys of sky, hills and trees.
        horizon: `Horizon`.
        buffers: `Buffers`.
    """
    height, width = image.shape
    rows = int(min(max(math.ceil(horizon.bottom), 0.0), height))
    _trace_outlines(lens, line, look, horizon, buffers)
    outlines = buffers.outlines
    highest = nb.float32(0.0)
    for j in range(width):
        highest = max(highest, outlines[_HILLS, j], outlines[_TREES, j])
    low, high = min(look.zenith, look.horizon), max(look.zenith, look.horizon)
    least, most = splat(nb.float32(low)), splat(nb.float32(high))
    columns = as_floats(lane_numbers()) + splat(nb.float32(0.5 - 0.5 * width))
    for i in range(rows):
        grey, change = _gradient(look, horizon, i, width, lens.focal)
        sky = madd(columns, splat(nb.float32(change)), splat(nb.float32(grey)))
        step, outlined = splat(nb.float32(LANES * change)), i + 1.0 + highest >= horizon.top
        for j in range(0, width, LANES):
            light = minimum(maximum(sky, least), most)
            if outlined:
                light = _with_outlines(light, outlines, look, horizon, i, j)
            store_part(image, i * width + j, width - j, light)
            sky = sky + step


@kernel
def _with_outlines(sky, outlines, look, horizon, row, column):
    """Return sixteen pixels of sky behind hills and trees."""
    width = outlines.shape[1]
    zero, one = splat(nb.float32(0.0)), splat(nb.float32(1.0))
    start = horizon.left + horizon.slope * (column + 0.5) - row
    # Rows from the top of the pixel to the horizon, and the height of its part above the horizon.
    above = madd(as_floats(lane_numbers()), splat(nb.float32(horizon.slope)), splat(nb.float32(start)))
    part = maximum(minimum(above, one), splat(nb.float32(1e-3)))
    fade = splat(nb.float32(-0.02 * look.leaf_gain))
    for layer in range(2):
        at, count = layer * width + column, width - column
        inside = load_part(outlines, at, count) - above
        cover = minimum(maximum((inside + part) / part, zero), one)
        if not any_above(cover, zero):
            continue
        grey = splat(nb.float32(look.hills))
        if layer == _TREES:
            grey = load_part(outlines, _LEAVES * width + column, count)
        depth = minimum(maximum(inside * load_part(outlines, at + _DEPTH * width, count), zero), one)
        sky = madd(cover, grey * madd(fade, depth, one) - sky, sky)
    return sky


_MAX_LOG2 = 13  # maximum width 8192 px, 0.044° each
_ROWS = 128  # heights are multiples of this
_NIGHT = 0.035  # light of a night sky, as a share of daylight


def panorama_table(camera: Camera, scene: Scene) -> np.ndarray:
    """Return the panorama of a camera under light and fog of its scene, at the resolution of its pixels.

    Columns run from the direction +x towards +y, texels are square, and the horizon is at half height.

    Returns:
        float32, shape (height, width), width a power of two; shape (0, 0) for the skyline.

    Raises:
        ValueError: If an image cannot be read.
    """
    name = scene.panorama
    if name == SKYLINE:
        return np.zeros((0, 0), dtype=np.float32)
    try:
        number = scene.seed if name == "natural" else Path(name).stat().st_mtime_ns
        return _panorama(name, number, scene.weather, camera.sensor.linear_light, camera.focal_px)
    except Exception as error:  # decoders raise many types of errors
        reason = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(
            f"scene panorama={name!r} cannot be read as an image ({reason}); "
            "pass the path of a PNG or JPEG, or 'skyline' or 'natural'"
        ) from error


@lru_cache(maxsize=8)
def _panorama(name: str, number: int, weather: Weather, linear: bool, focal_px: float) -> np.ndarray:
    """Return the panorama of a seed (for "natural"), or of an image file with a time stamp."""
    picture = natural_panorama(number) if name == "natural" else _read_image(name, number)
    grey = picture.astype(np.float32)
    if linear:
        grey *= grey / np.float32(WHITE)
    # Halve the resolution while a pixel at the centre of the frame covers more than about 1.4 texels.
    while grey.shape[1] > 16 and 1.0 / focal_px > 1.4 * 2.0 * math.pi / grey.shape[1]:
        grey = 0.25 * (grey[0::2, 0::2] + grey[1::2, 0::2] + grey[0::2, 1::2] + grey[1::2, 1::2])
        if grey.shape[0] % 2:
            grey = np.concatenate((grey, grey[-1:]))
    if weather.light == "night":
        grey *= _NIGHT
    if weather.visibility_m > 0.0:
        haze = to_light(haze_grey(weather), linear)
        grey = haze + far_transmission(weather) * (grey - haze)
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
