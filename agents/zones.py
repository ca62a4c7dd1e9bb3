"""Geometry of the stopping zones: one pair of camera fields for each design speed.

A zone is the part of the ego lane in front of the point at which the car stops after full braking. Its ground
field covers the road surface of the zone. Its upright field covers a band at the horizon with the same width.
"""

from bisect import bisect_left
from math import atan, degrees
from typing import Any, TypeVar

import numpy as np

SPEEDS_KMH = (10, 20, 25, 30, 40, 50, 60, 70, 80, 90)  # design speed of each zone
NUM_ZONES = len(SPEEDS_KMH)
KMH = 1 / 3.6  # [m/s]
_SPEEDS = [speed * KMH for speed in SPEEDS_KMH]  # [m/s]
FULL_DECELERATION = 9.0  # deceleration of full braking [m/s²]
LENS_HEIGHT, LENS_SETBACK = 1.2, 1.7  # lens above the road and behind the front bumper [m]
HALF_WIDTH = 1.2  # half the width of a field at the far end of its zone [m]
# Frame shape (height, width) [px] and pitch of the two kinds of field. The unit of pitch is the angle from
# the horizon down to the zone's far end. In this unit the ground field spans -1.75 to -1.0 and the upright
# field -0.15 to 0.35. A car of 1.4 m height at the far end reaches 0.19. A guard rail stays below 0.
FIELDS = {"ground": ((30, 80), -1.375), "upright": ((20, 80), 0.1)}

Speed = TypeVar("Speed", float, np.ndarray)


def stopping_distance(speed: Speed, deceleration: float, reaction: float) -> Speed:
    """Return the stopping distance v²/(2 · deceleration) + v · reaction [m] for a speed v [m/s]."""
    return speed**2 / (2 * deceleration) + speed * reaction


def zone_ends(deceleration: float, reaction: float) -> np.ndarray:
    """Return the stopping distance for each design speed: the far ends of the zones, shape (10,) [m]."""
    return stopping_distance(np.array(SPEEDS_KMH) * KMH, deceleration, reaction)


def zone_index(speed: float) -> int:
    """Return the index of the zone for a speed [m/s]: the next higher design speed, at most the last."""
    return min(bisect_left(_SPEEDS, speed), NUM_ZONES - 1)


def zone_indices(speeds: np.ndarray) -> np.ndarray:
    """Return the index of the zone for each speed [m/s], see `zone_index`."""
    return np.minimum(np.searchsorted(_SPEEDS, speeds), NUM_ZONES - 1)


def zone_cameras(ends: np.ndarray) -> list[dict[str, Any]]:
    """Return the cameras for zones with given far ends [m]: ten ground fields, then ten upright fields."""
    cameras: list[dict[str, Any]] = []
    for name, (shape, pitch) in FIELDS.items():
        for speed, end in zip(SPEEDS_KMH, ends, strict=True):
            depth = float(end) + LENS_SETBACK
            cameras.append(
                {
                    "name": f"{name}{speed}",
                    "shape": list(shape),
                    "hfov_deg": round(2 * degrees(atan(HALF_WIDTH / depth)), 4),
                    "pitch_deg": round(pitch * degrees(atan(LENS_HEIGHT / depth)), 4),
                    "gaze": "path",
                }
            )
    return cameras
