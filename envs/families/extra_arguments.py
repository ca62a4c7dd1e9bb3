"""Scenario families that random levels contain on request only, and how their arguments are drawn.

The levels of the id v0 keep their numbers, families and arguments. Families that were added later are
therefore drawn only where `families` names them, as are usual families at the speeds of a motorway, whose
names begin with "Fast", and those with other limits: `NarrowBox` and `CloseBrakeRelease`.

Names that end in "WithoutTarget" are threats without their target. The usual non-threats are rarely on a road
with two lanes or at a crossing: a policy that is trained on them alone learns to brake for the road.
"""

from functools import partial
from math import exp, log
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.curves import MAX_LATERAL
from lgmd_gym.envs.families.random_arguments import NON_THREATS, THREATS, Draw
from lgmd_gym.envs.families.rear import RELEASE

SPEED_KMH = (20.0, 100.0)
RADIUS = (50.0, 1500.0)  # [m]
FAST_KMH = (80.0, 130.0)
TOP_KMH = 140.0  # of other cars


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


def _box(rng: np.random.Generator, widest: float = 2.5) -> dict[str, Any]:
    return {
        "ego_speed": _uniform(rng, *SPEED_KMH) * KMH,
        "width": _uniform(rng, 0.3, widest),
        "height": _uniform(rng, 0.6, 2.5),
        "length": _uniform(rng, 0.3, 5.0),
        "lateral_offset": _uniform(rng, -0.5, 0.5),
    }


def _close_release(rng: np.random.Generator) -> dict[str, Any]:
    """Return a short headway, and a brake tap that takes 10 to 60 % of it."""
    speed, headway = _uniform(rng, 40.0, 100.0) * KMH, _uniform(rng, 1.0, 2.0)
    lost = _uniform(rng, 0.1, 0.6) * speed * headway
    drop = min((RELEASE * lost) ** 0.5, 6.0)
    return {"ego_speed": speed, "headway": headway, "speed_drop": drop}


def _fast(usual: Draw, rng: np.random.Generator) -> dict[str, Any]:
    """Return the arguments of a usual draw with a high ego speed."""
    return usual.draw(rng) | {"ego_speed": _uniform(rng, *FAST_KMH) * KMH}


def _overtaken(rng: np.random.Generator) -> dict[str, Any]:
    speed = _uniform(rng, *FAST_KMH) * KMH
    return {"ego_speed": speed, "excess": _uniform(rng, 10.0 * KMH, max(TOP_KMH * KMH - speed, 11.0 * KMH))}


def _fast_draws(usual: dict[str, Draw], weights: dict[str, float]) -> dict[str, Draw]:
    """Return draws of usual families at high speed, by the names "Fast" + family."""
    return {
        f"Fast{name}": Draw(weight, partial(_fast, usual[name]), name) for name, weight in weights.items()
    }


def _without_target(threats: dict[str, Draw], names: tuple[str, ...]) -> dict[str, Draw]:
    """Return draws of threats without their target, by the names family + "WithoutTarget".

    Their weights are half of those of the threats, so that a policy cannot infer a threat from the road
    alone, and their order is the same. With some threats alone, and with the same threats without their
    targets alone, levels of the same number therefore differ by the target only. Threats on a straight road
    with three lanes are not among them; EmptyRoad has that road, too.
    """
    in_order = sorted(names, key=list(threats).index)
    return {
        f"{name}WithoutTarget": Draw(threats[name].weight / 2.0, threats[name].draw, name, False)
        for name in in_order
    }


EXTRA_THREATS = {
    "CCRsCurve": Draw(3.0, _standing),
    "StandingBox": Draw(2.0, _box),
    "NarrowBox": Draw(2.0, partial(_box, widest=1.2), "StandingBox"),
    **_fast_draws(THREATS, {"CCRs": 3.0, "CCRm": 2.0, "CCRb": 2.0}),
}
EXTRA_NON_THREATS = {
    "CurvePass": Draw(1.0, _pass),
    "CloseBrakeRelease": Draw(1.0, _close_release, "BrakeRelease"),
    "FastOvertaken": Draw(0.5, _overtaken, "Overtaken"),
    **_fast_draws(
        NON_THREATS,
        {"EmptyRoad": 0.5, "Following": 0.5, "BrakeRelease": 0.5, "AdjacentPass": 0.3, "BridgeShadow": 0.2},
    ),
    **_without_target(
        THREATS | EXTRA_THREATS,
        (
            *("CCCscp", "CCFtap", "CCFhos", "CCFhol", "CMCscp", "CMFtap", "CCRsCurve"),
            *("CPNA", "CPFA", "CPNCO", "CPLA", "CPTA", "CPRA"),
            *("CBNA", "CBNAO", "CBFA", "CBLA"),
        ),
    ),
}
