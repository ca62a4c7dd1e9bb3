"""Arguments that many families share: their declarations, and how random levels draw them."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import numpy as np

from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.fields import choice, flag, number, optional, value, whole

DrawArguments = Callable[[np.random.Generator], dict[str, Any]]
"""Draws the arguments of a family."""
SPEED_KMH = (10.0, 80.0)
FAST_KMH = (80.0, 130.0)  # of a motorway
HEADWAY = (0.5, 3.0)  # [s]; in FMVSS 127 a lead car brakes 12 m ahead at 80 km/h, a headway of 0.54 s


def within(bounds: str, unit: str, doc: str) -> Any:
    """Declare a number; see `lgmd_gym.fields.number`."""
    return number(None, bounds, unit, doc)


def speed(doc: str, zero: bool = False) -> Any:
    """Declare a speed up to 40 m/s, above 0 or, with `zero`, from 0 on."""
    limits = "[0, 40]" if zero else "(0, 40]"
    return value(None, partial(check_speed, zero=zero), doc, limits, "m/s")


def slower(doc: str, zero: bool = False) -> Any:
    """Declare a speed below that of the ego."""
    limits = "[0, ego_speed)" if zero else "(0, ego_speed)"
    return value(None, partial(check_speed, zero=zero), doc, limits, "m/s")


def grey(of: str) -> Any:
    """Declare a grey level that is drawn by default."""
    return optional(whole(None, "[0, 255]", doc=f"Grey level of {of}; None to draw it from the seed"))


def truth(doc: str) -> Any:
    """Declare a bool."""
    return flag(None, doc)


def one_of(names: tuple[str, ...], doc: str) -> Any:
    """Declare one of some names."""
    return choice(None, names, doc)


EgoSpeed = Annotated[float, speed("Ego speed")]
Shade = Annotated[int | None, grey("the target")]
ClothesShade = Annotated[int | None, grey("the clothes")]
RiderShade = Annotated[int | None, grey("the rider's clothes")]
OtherShade = Annotated[int | None, grey("the other car")]
LeadShade = Annotated[int | None, grey("the lead car")]
Headway = Annotated[float, within("[0.3, 10]", "s", "Time headway")]
Deceleration = Annotated[float, within("[0.5, 10]", "m/s²", "Full deceleration of the other")]
ChangeLength = Annotated[float, within("[10, 200]", "m", "Length of the lane change along the road")]
LeftCurve = Annotated[bool, truth("Whether the curve turns left; otherwise right")]


def uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """DrawArguments a number."""
    return float(rng.uniform(low, high))


def speed_kmh(rng: np.random.Generator, low: float = SPEED_KMH[0], high: float = SPEED_KMH[1]) -> float:
    """DrawArguments a speed between limits in km/h, and return it in m/s."""
    return uniform(rng, low, high) * KMH


def either(rng: np.random.Generator) -> bool:
    """DrawArguments True or False."""
    return bool(rng.random() < 0.5)


def side(rng: np.random.Generator) -> str:
    """DrawArguments "left" or "right"."""
    return "left" if either(rng) else "right"


def ego_speed(low: float = SPEED_KMH[0], high: float = SPEED_KMH[1]) -> DrawArguments:
    """Return a function that draws the ego speed alone, between limits in km/h."""
    return lambda rng: {"ego_speed": speed_kmh(rng, low, high)}


def fast(draw: DrawArguments) -> DrawArguments:
    """Return a draw with the ego speed of a motorway."""
    return lambda rng: draw(rng) | {"ego_speed": speed_kmh(rng, *FAST_KMH)}
