"""Arguments that many families share: their declarations, and how random levels draw them."""

from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.fields import Field, choice, flag, number, optional, value, whole

DrawArguments = Callable[[np.random.Generator], Arguments]
"""Draws the arguments of a family."""
Sampler = Callable[[np.random.Generator], Any]
"""Draws one argument."""
SPEED_KMH = (10.0, 80.0)
FAST_KMH = (80.0, 130.0)  # of a motorway
HEADWAY = (0.5, 3.0)  # [s]; in FMVSS 127 a lead car brakes 12 m ahead at 80 km/h, a headway of 0.54 s


def within(bounds: str, unit: str, doc: str) -> Field:
    """Declare a number; see `lgmd_gym.fields.number`."""
    return number(None, bounds, unit, doc)


def speed(doc: str, zero: bool = False) -> Field:
    """Declare a speed up to 40 m/s, above 0 or, with `zero`, from 0 on."""
    limits = "[0, 40]" if zero else "(0, 40]"
    return value(None, partial(check_speed, zero=zero), doc, limits, "m/s")


def slower(doc: str, zero: bool = False) -> Field:
    """Declare a speed below that of the ego."""
    limits = "[0, ego_speed)" if zero else "(0, ego_speed)"
    return value(None, partial(check_speed, zero=zero), doc, limits, "m/s")


def grey(of: str) -> Field:
    """Declare a grey level that is drawn by default."""
    return optional(whole(None, "[0, 255]", doc=f"Grey level of {of}; None to draw it from the seed"))


def maybe(bounds: str, unit: str, doc: str) -> Field:
    """Declare a number or None."""
    return optional(within(bounds, unit, doc))


def truth(doc: str) -> Field:
    """Declare a bool."""
    return flag(None, doc)


def one_of(names: tuple[str, ...], doc: str) -> Field:
    """Declare one of some names."""
    return choice(None, names, doc)


EgoSpeed = Annotated[float, speed("Ego speed")]
Shade = Annotated[int | None, grey("the target")]
ClothesShade = Annotated[int | None, grey("the clothes")]
RiderShade = Annotated[int | None, grey("the rider's clothes")]
OtherShade = Annotated[int | None, grey("the other car")]
LeadShade = Annotated[int | None, grey("the lead car")]
Headway = Annotated[float, within("[0.3, 10]", "s", "Time headway")]
ChangeLength = Annotated[float, within("[10, 200]", "m", "Length of the lane change along the road")]
LeftCurve = Annotated[bool, truth("Whether the curve turns left; otherwise right")]


def between(low: float, high: float) -> Sampler:
    """Return a sampler of a number."""
    return lambda rng: float(rng.uniform(low, high))


def kmh(low: float = SPEED_KMH[0], high: float = SPEED_KMH[1]) -> Sampler:
    """Return a sampler of a speed between limits in km/h, in m/s."""
    return lambda rng: float(rng.uniform(low, high)) * KMH


def one(first: object, second: object) -> Sampler:
    """Return a sampler of one of two values."""
    return lambda rng: first if rng.random() < 0.5 else second


def draw(**samplers: Sampler) -> DrawArguments:
    """Return a function that draws arguments, each from its sampler, in this order."""
    return lambda rng: {name: sample(rng) for name, sample in samplers.items()}


def fast(drawn: DrawArguments) -> DrawArguments:
    """Return a function that draws the same arguments with the ego speed of a motorway."""
    return lambda rng: drawn(rng) | {"ego_speed": kmh(*FAST_KMH)(rng)}


EITHER = one(True, False)
"""Sampler of True or False."""


def always(_: object) -> bool:
    """Sample True."""
    return True


def still(_: object) -> float:
    """Sample a speed of 0."""
    return 0.0
