"""Scenario families that random levels contain on request only, and how their arguments are drawn.

The levels of the id v0 keep their numbers, families and arguments. Families that were added later are
therefore drawn only where `families` names them.
"""

from math import exp, log
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.scenarios.curves import MAX_LATERAL
from lgmd_gym.envs.scenarios.random_arguments import Draw

SPEED_KMH = (20.0, 100.0)
RADIUS = (50.0, 1500.0)  # [m]


def _uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.uniform(low, high))


def _flag(rng: np.random.Generator) -> bool:
    return bool(rng.random() < 0.5)


def _curve(rng: np.random.Generator) -> dict[str, Any]:
    """Return a speed, and a radius that is uniform on a logarithmic scale."""
    speed = _uniform(rng, *SPEED_KMH) * KMH
    lowest = max(RADIUS[0], 1.01 * speed**2 / MAX_LATERAL)
    radius = exp(_uniform(rng, log(lowest), log(RADIUS[1])))
    return {"ego_speed": speed, "radius": radius, "left": _flag(rng)}


def _standing(rng: np.random.Generator) -> dict[str, Any]:
    return _curve(rng) | {
        "lateral_offset": _uniform(rng, -0.4, 0.4),
        "entry": _uniform(rng, 0.0, 3.0) if rng.random() < 0.4 else 0.0,
    }


def _pass(rng: np.random.Generator) -> dict[str, Any]:
    oncoming = _uniform(rng, 20.0, 100.0) * KMH if _flag(rng) else 0.0
    to_left = oncoming > 0.0 or _flag(rng)
    offset = _uniform(rng, 3.2, 4.0) if to_left else -_uniform(rng, 2.9, 4.0)
    return _curve(rng) | {"lateral_offset": offset, "oncoming_speed": oncoming}


def _box(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "ego_speed": _uniform(rng, *SPEED_KMH) * KMH,
        "width": _uniform(rng, 0.3, 2.5),
        "height": _uniform(rng, 0.6, 2.5),
        "length": _uniform(rng, 0.3, 5.0),
        "lateral_offset": _uniform(rng, -0.5, 0.5),
    }


EXTRA_THREATS = {"CCRsCurve": Draw(3.0, _standing), "StandingBox": Draw(2.0, _box)}
EXTRA_NON_THREATS = {"CurvePass": Draw(1.0, _pass)}
