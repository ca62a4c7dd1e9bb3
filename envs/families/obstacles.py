"""Marks, shadows and dots on an otherwise empty road: driving without a threat."""

from typing import Annotated

import numpy as np

from lgmd_gym.aliases import Arguments
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families.arguments import EgoSpeed, between, draw, fast, kmh, within
from lgmd_gym.envs.families.family import Level, family
from lgmd_gym.envs.families.scenario import BRIDGE_SHADOW, START_TTC, Actor, Scenario, bridge_shadow
from lgmd_gym.fields import whole

STEEL = 150  # grey level
DOT, DOT_SHADE = 0.1, 230  # [m], size of a raised pavement marker; white ceramic
DOT_ROWS, DOTS_PER_ROW, DOT_SPACING, ROW_SPACING = 4, 6, 0.5, 2.0  # [m]


@family(
    "EmptyRoad",
    Level("EmptyRoad", 1.0, draw(ego_speed=kmh())),
    Level("FastEmptyRoad", 0.5, fast(draw(ego_speed=kmh()))),
)
def drive_alone(ego_speed: EgoSpeed = 50 * KMH) -> Scenario:
    """The ego drives on an empty road; only lane lines and road texture move; not a threat."""
    return Scenario(family="EmptyRoad", ego_speed=ego_speed, duration=10.0)


def _cover(rng: np.random.Generator) -> Arguments:
    """Draw a dark or bright cover of 0.5 to 0.9 m in the lane."""
    size = between(0.5, 0.9)(rng)
    shade = int(rng.integers(20, 200))
    return {"ego_speed": kmh()(rng), "shade": shade, "length": size, "width": size}


@family(
    "SteelPlate",
    Level("SteelPlate", 1.0, draw(ego_speed=kmh(30.0), shade=lambda rng: int(rng.integers(110, 200)))),
    Level("ManholeCover", 1.0, _cover),
)
def drive_over_plate(
    ego_speed: EgoSpeed = 80 * KMH,
    shade: Annotated[int, whole(None, "[0, 255]", doc="Grey level of the plate")] = STEEL,
    length: Annotated[float, within("[0.1, 10]", "m", "Length of the plate")] = 3.7,
    width: Annotated[float, within("[0.1, 10]", "m", "Width of the plate")] = 2.4,
) -> Scenario:
    """The ego drives over a plate that is flat on the road, by default a steel plate; not a threat.

    Source: 49 CFR 571.127 S9.2 at 80 km/h, GB 39901-2025 at 60 km/h; both have a plate of 2.4 × 3.7 m.
    """
    plate = Actor(
        gap=START_TTC * ego_speed, kind="road_marking", shade=shade, length=length, width=width, height=0.025
    )
    return Scenario(family="SteelPlate", ego_speed=ego_speed, duration=START_TTC + 2.0, actors=(plate,))


_SHADOW = draw(ego_speed=kmh(30.0), length=between(5.0, 20.0))


@family("BridgeShadow", Level("BridgeShadow", 1.0, _SHADOW), Level("FastBridgeShadow", 0.2, fast(_SHADOW)))
def drive_through_shadow(
    ego_speed: EgoSpeed = 80 * KMH,
    length: Annotated[float, within("[1, 100]", "m", "Length of the shadow along the road")] = 12.0,
    shade: Annotated[int, whole(None, "[0, 255]", doc="Grey level of the shadow")] = BRIDGE_SHADOW,
) -> Scenario:
    """The ego drives through the shadow of a bridge; not a threat."""
    shadow = bridge_shadow(START_TTC * ego_speed, length, shade)
    duration = START_TTC + length / ego_speed + 2.0
    return Scenario(family="BridgeShadow", ego_speed=ego_speed, duration=duration, actors=(shadow,))


@family("BottsDots", Level("BottsDots", 1.0, draw(ego_speed=kmh(30.0))))
def drive_over_dots(ego_speed: EgoSpeed = 72.4 * KMH) -> Scenario:
    """The ego drives over four rows of raised pavement markers (Botts' dots) in its lane; not a threat.

    The markers are 0.1 m wide and drawn as flat white squares, six to a row. Source: NHTSA.
    """
    dots = tuple(
        Actor(
            gap=START_TTC * ego_speed + row * ROW_SPACING,
            lateral_offset=(number - (DOTS_PER_ROW - 1) / 2) * DOT_SPACING,
            kind="road_marking",
            shade=DOT_SHADE,
            length=DOT,
            width=DOT,
            height=0.02,
        )
        for row in range(DOT_ROWS)
        for number in range(DOTS_PER_ROW)
    )
    return Scenario(family="BottsDots", ego_speed=ego_speed, duration=START_TTC + 2.0, actors=dots)
