"""Scenario families of the random levels: how often each one occurs, and how its arguments are drawn."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.envs.dynamics.units import KMH

SPEED_KMH = (10.0, 80.0)
HEADWAY = (0.5, 3.0)  # [s]; in FMVSS 127 a lead car brakes 12 m ahead at 80 km/h, a headway of 0.54 s


class Draw(NamedTuple):
    """A family of the distribution.

    Attributes:
        weight: Relative frequency among the threats or the non-threats.
        draw: Function that draws the arguments of the family.
        family: Name of the scenario family; empty if it is the key of the draw.
        has_target: Whether the scenario has its target, or is without it, see `without_target`.
    """

    weight: float
    draw: Callable[[np.random.Generator], dict[str, Any]]
    family: str = ""
    has_target: bool = True


def _speed(rng: np.random.Generator, low: float = SPEED_KMH[0], high: float = SPEED_KMH[1]) -> float:
    return float(rng.uniform(low, high)) * KMH


def _flag(rng: np.random.Generator) -> bool:
    return bool(rng.random() < 0.5)


def _side(rng: np.random.Generator) -> str:
    return "left" if _flag(rng) else "right"


def _overlap(rng: np.random.Generator) -> float:
    """Return 1 (aligned) with probability 0.5, otherwise an overlap of 0.4 to 1 on either side."""
    if _flag(rng):
        return 1.0
    return float(rng.uniform(0.4, 1.0)) * (1.0 if _flag(rng) else -1.0)


def _moving(rng: np.random.Generator) -> dict[str, Any]:
    speed = _speed(rng, 30.0)
    return {
        "ego_speed": speed,
        "target_speed": speed * float(rng.uniform(0.2, 0.7)),
        "overlap": _overlap(rng),
    }


def _braking(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "ego_speed": _speed(rng, 30.0),
        "headway": float(rng.uniform(*HEADWAY)),
        "deceleration": float(rng.uniform(2.0, 6.0)),
        "build_up": float(rng.uniform(0.3, 1.0)),
        "overlap": _overlap(rng),
    }


def _adjacent(rng: np.random.Generator) -> dict[str, Any]:
    offset = float(rng.uniform(3.0, 3.7)) * (1.0 if _flag(rng) else -1.0)
    return {"ego_speed": _speed(rng), "lateral_offset": offset, "cars": int(rng.integers(1, 7))}


def _rail(rng: np.random.Generator) -> dict[str, Any]:
    radius = float(rng.uniform(40.0, 200.0))
    top = min(SPEED_KMH[1], (3.5 * radius) ** 0.5 / KMH)
    return {"ego_speed": _speed(rng, 20.0, top), "radius": radius, "left": _flag(rng)}


def _crossing_vehicle(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "ego_speed": _speed(rng, 20.0, 60.0),
        "target_speed": _speed(rng, 20.0, 60.0),
        "side": _side(rng),
        "obstructed": _flag(rng),
    }


def _motorcycle(rng: np.random.Generator) -> dict[str, Any]:
    return {"ego_speed": _speed(rng), "impact_location": float(rng.uniform(0.1, 0.9))}


def _walker(rng: np.random.Generator, low: float = 3.0, high: float = 8.0) -> dict[str, Any]:
    return {
        "ego_speed": _speed(rng, 10.0, 60.0),
        "walking_speed": _speed(rng, low, high),
        "impact_location": float(rng.uniform(0.1, 0.9)),
    }


def _rider(rng: np.random.Generator, low: float, high: float) -> dict[str, Any]:
    return {
        "ego_speed": _speed(rng, 10.0, 60.0),
        "bicycle_speed": _speed(rng, low, high),
        "impact_location": float(rng.uniform(0.1, 0.9)),
    }


def _bicycle_ahead(rng: np.random.Generator) -> dict[str, Any]:
    return _rider(rng, 10.0, 20.0) | {"ego_speed": _speed(rng, 25.0)}


def _turn(rng: np.random.Generator) -> dict[str, Any]:
    return {"ego_speed": _speed(rng, 10.0, 25.0), "target_speed": _speed(rng, 30.0, 80.0)}


def _lane_change(rng: np.random.Generator) -> dict[str, Any]:
    oncoming = _speed(rng, 40.0)
    return {
        "ego_speed": _speed(rng, 30.0),
        "target_speed": oncoming,
        "change_length": oncoming * float(rng.uniform(2.7, 4.0)),
        "following_distance": float(rng.uniform(10.0, 25.0)),
    }


def _neighbour(rng: np.random.Generator) -> dict[str, Any]:
    return {
        "ego_speed": _speed(rng, 30.0),
        "headway": float(rng.uniform(0.8, 2.0)),
        "deceleration": float(rng.uniform(2.0, 6.0)),
        "radius": float(rng.uniform(150.0, 400.0)) if _flag(rng) else 0.0,
    }


THREATS = {
    "CCRs": Draw(15.0, lambda rng: {"ego_speed": _speed(rng), "overlap": _overlap(rng)}),
    "CCRm": Draw(13.0, _moving),
    "CCRb": Draw(13.0, _braking),
    "CCCscp": Draw(8.0, _crossing_vehicle),
    "CCFtap": Draw(4.0, _turn),
    "CCFhos": Draw(
        3.0,
        lambda rng: {
            "ego_speed": _speed(rng, 30.0),
            "target_speed": _speed(rng, 30.0),
            "impact_location": float(rng.uniform(0.0, 1.0)),
        },
    ),
    "CCFhol": Draw(2.0, _lane_change),
    "CMRs": Draw(4.0, _motorcycle),
    "CMRb": Draw(4.0, lambda rng: _motorcycle(rng) | {"headway": float(rng.uniform(*HEADWAY))}),
    "CMCscp": Draw(3.0, _crossing_vehicle),
    "CMFtap": Draw(2.0, _turn),
    "CPNA": Draw(5.0, lambda rng: _walker(rng) | {"child": _flag(rng)}),
    "CPFA": Draw(4.0, lambda rng: _walker(rng, 5.0, 10.0)),
    "CPNCO": Draw(3.0, _walker),
    "CPLA": Draw(4.0, lambda rng: _walker(rng) | {"ego_speed": _speed(rng, 20.0)}),
    "CPTA": Draw(
        2.0,
        lambda rng: {
            "ego_speed": _speed(rng, 10.0, 20.0),
            "left": _flag(rng),
            "direction": "same" if _flag(rng) else "opposite",
        },
    ),
    "CPRA": Draw(
        1.0,
        lambda rng: {"ego_speed": _speed(rng, 4.0, 8.0), "moving": _flag(rng), "child": _flag(rng)},
    ),
    "CBNA": Draw(3.0, lambda rng: _rider(rng, 10.0, 20.0) | {"obstructed": _flag(rng)}),
    "CBNAO": Draw(2.0, lambda rng: _rider(rng, 8.0, 15.0)),
    "CBFA": Draw(2.0, lambda rng: _rider(rng, 15.0, 25.0)),
    "CBLA": Draw(3.0, _bicycle_ahead),
}
"""Threats of the random levels: 41 % rear ends of cars, the other families with the rest."""
NON_THREATS = {
    "Following": Draw(1.0, lambda rng: {"ego_speed": _speed(rng), "headway": float(rng.uniform(*HEADWAY))}),
    "BrakeRelease": Draw(
        1.0,
        lambda rng: {
            "ego_speed": _speed(rng, 40.0),
            "headway": float(rng.uniform(1.5, 2.5)),
            "speed_drop": float(rng.uniform(2.0, 5.0)),
        },
    ),
    "AdjacentPass": Draw(1.0, _adjacent),
    "PassBetween": Draw(
        1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "inner_gap": float(rng.uniform(4.0, 5.0))}
    ),
    "Overtaken": Draw(1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "excess": _speed(rng, 10.0, 40.0)}),
    "Oncoming": Draw(1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "oncoming_speed": _speed(rng, 30.0)}),
    "CutIn": Draw(1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "gap": float(rng.uniform(10.0, 25.0))}),
    "CutOut": Draw(
        1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "headway": float(rng.uniform(1.2, 2.5))}
    ),
    "EmptyRoad": Draw(1.0, lambda rng: {"ego_speed": _speed(rng)}),
    "SteelPlate": Draw(
        1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "shade": int(rng.integers(110, 200))}
    ),
    "BridgeShadow": Draw(
        1.0, lambda rng: {"ego_speed": _speed(rng, 30.0), "length": float(rng.uniform(5.0, 20.0))}
    ),
    "PedestrianPass": Draw(
        1.0,
        lambda rng: {
            "ego_speed": _speed(rng, 20.0, 50.0),
            "clearance": float(rng.uniform(1.0, 1.5)),
        },
    ),
    "CurveGuardRail": Draw(1.0, _rail),
    "CrossingClears": Draw(
        1.0,
        lambda rng: {
            "ego_speed": _speed(rng, 20.0, 60.0),
            "target_speed": _speed(rng, 20.0, 60.0),
            "side": _side(rng),
            "clear_by": float(rng.uniform(1.2, 2.5)),
        },
    ),
    "TurnBeforeOncoming": Draw(1.0, lambda rng: {"left": _flag(rng)}),
    "LeadTurnsOff": Draw(1.0, lambda rng: {"left": _flag(rng)}),
    "CurveObjectOutside": Draw(1.0, lambda rng: {"left": _flag(rng)}),
    "LaneClosure": Draw(1.0, lambda rng: {"ego_speed": _speed(rng, 25.0, 55.0), "left": _flag(rng)}),
    "BicyclePass": Draw(
        1.0,
        lambda rng: {
            "ego_speed": _speed(rng, 20.0, 50.0),
            "clearance": float(rng.uniform(1.0, 1.5)),
            "bicycle_speed": _speed(rng, 5.0, 20.0),
        },
    ),
    "BottsDots": Draw(1.0, lambda rng: {"ego_speed": _speed(rng, 30.0)}),
    "AdjacentBraking": Draw(1.0, _neighbour),
    "CurveStandingCar": Draw(
        1.0,
        lambda rng: {
            "ego_speed": _speed(rng, 30.0),
            "place": "entrance" if _flag(rng) else "exit",
            "radius": float(rng.uniform(150.0, 400.0)),
        },
    ),
}
