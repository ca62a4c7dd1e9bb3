"""Colours of traces and lamps for colour-blind readers."""

from itertools import combinations

import numpy as np
import pytest

from lgmd_gym.rendering.canvas import PINK, RED, UNLIT, YELLOW
from lgmd_gym.rendering.dashboard import CAMERA_COLOURS

# Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
COLOUR_BLINDNESS = {
    "protan": (
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ),
    "deutan": (
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ),
    "tritan": (
        (1.255528, -0.076749, -0.178779),
        (-0.078411, 0.930809, 0.147602),
        (0.004733, 0.691367, 0.303900),
    ),
}


def to_lab(rgb, matrix):
    """Return CIELAB coordinates of a colour as perceived with a colour-vision deficiency."""
    linear = ((np.asarray(rgb) / 255.0 + 0.055) / 1.055) ** 2.4
    linear = np.clip(np.asarray(matrix) @ linear, 0.0, 1.0)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    f = np.cbrt(np.maximum(np.array(to_xyz) @ linear / (0.9505, 1.0, 1.089), 1e-9))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("kind", COLOUR_BLINDNESS)
def test_colour_differences_exceed_20(kind):
    """CIE76 differences of the traces of cameras, and of the lamps."""
    matrix = COLOUR_BLINDNESS[kind]
    pairs = [*combinations(CAMERA_COLOURS, 2), *combinations((YELLOW, RED, PINK, UNLIT), 2)]
    differences = {pair: np.linalg.norm(to_lab(pair[0], matrix) - to_lab(pair[1], matrix)) for pair in pairs}
    assert {pair: value for pair, value in differences.items() if value <= 20.0} == {}
