"""Features of ground textures: seams, patches, cracks, joints and stones.

A texture is an array of deviations in units of its standard deviation, shape (texels along x, along y),
periodic in both directions; see `texture.TEXEL_M` for the size of a texel.
"""

import numpy as np

EXPONENTS = {
    "asphalt": 0.85, "verge": 1.1,
    "fresh": 0.5, "aged": 0.85, "patched": 0.85, "cracked": 0.8, "coarse": 0.35, "concrete": 0.7,
    "grass": 0.9, "gravel": 0.3, "soil": 1.2, "paving": 0.6,
}  # fmt: skip
"""Exponent of the amplitude spectrum, 1/frequency^exponent, by kind of ground."""

STREAMS = {kind: number for number, kind in enumerate(EXPONENTS, start=1)}
"""Second seed of the random generator of each kind of ground."""

_JOINT = 128  # texels between the joints of concrete slabs, 5.12 m
_SETT = 16  # texels of a paving stone, 0.64 m


def add_features(kind: str, tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add the features of a kind of ground to noise of unit variance, in place."""
    if kind == "asphalt":
        _add_seams(tile, rng, seams=14, patches=8)
    elif kind == "aged":
        _add_seams(tile, rng, seams=8, patches=3)
    elif kind == "patched":
        _add_seams(tile, rng, seams=22, patches=34)
    elif kind == "cracked":
        _add_cracks(tile, rng)
    elif kind == "concrete":
        _add_slabs(tile, rng)
    elif kind == "paving":
        _add_stones(tile, rng)
    elif kind == "grass":
        _add_tufts(tile, rng)


def _add_seams(tile: np.ndarray, rng: np.random.Generator, seams: int, patches: int) -> None:
    """Add the sealed cracks and patches of an older road."""
    long, wide = tile.shape
    for _ in range(seams):
        x, y = int(rng.integers(long)), int(rng.integers(wide))
        span, thick = int(rng.integers(60, 220)), int(rng.integers(2, 4))
        wander = np.cumsum(rng.integers(-1, 2, span))
        for step in range(span):
            rows = (x + wander[step] + np.arange(thick)) % long
            tile[rows, (y + step) % wide] -= 2.2
    for _ in range(patches):
        x, y = int(rng.integers(long)), int(rng.integers(wide))
        rows = (x + np.arange(int(rng.integers(40, 160)))) % long
        cols = (y + np.arange(int(rng.integers(25, 80)))) % wide
        tile[np.ix_(rows, cols)] += float(rng.choice((-0.9, 0.8)))


def _add_cracks(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add cracks that wander along and across the road, some of them sealed with dark or light filler."""
    long, wide = tile.shape
    for _ in range(60):
        along, span = rng.random() < 0.6, int(rng.integers(80, 400))
        thick, depth = int(rng.integers(1, 4)), float(rng.choice((-2.6, -1.6, 1.2)))
        steps, drift = np.arange(span), np.cumsum(rng.integers(-1, 2, span))
        x = int(rng.integers(long)) + (steps if along else drift)
        y = int(rng.integers(wide)) + (drift if along else steps)
        for k in range(thick):
            tile[(x + (0 if along else k)) % long, (y + (k if along else 0)) % wide] += depth


def _add_slabs(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add concrete slabs of 5.12 m with different tones, and their dark joints."""
    long, wide = tile.shape
    tones = rng.normal(0.0, 0.8, (long // _JOINT, wide // _JOINT))
    tile += np.repeat(np.repeat(tones, _JOINT, axis=0), _JOINT, axis=1).astype(np.float32)
    for offset in range(2):
        tile[offset::_JOINT] -= 2.8
        tile[:, offset::_JOINT] -= 1.8


def _add_stones(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add paving stones with different tones, and their joints."""
    long, wide = tile.shape
    tones = rng.normal(0.0, 0.7, (long // _SETT, wide // _SETT))
    tile += np.repeat(np.repeat(tones, _SETT, axis=0), _SETT, axis=1).astype(np.float32)
    tile[::_SETT] -= 1.6
    tile[:, ::_SETT] -= 1.6


def _add_tufts(tile: np.ndarray, rng: np.random.Generator) -> None:
    """Add dark and light tufts of grass."""
    long, wide = tile.shape
    for _ in range(500):
        x, y, size = int(rng.integers(long)), int(rng.integers(wide)), int(rng.integers(4, 20))
        rows, cols = (x + np.arange(size)) % long, (y + np.arange(size)) % wide
        tile[np.ix_(rows, cols)] += float(rng.choice((-1.4, 1.1)))
