"""Scenario with a box that stands on the road, such as lost cargo or a low trailer."""

from lgmd_gym.envs.dynamics.units import KMH, check_speed
from lgmd_gym.envs.families.registry import family
from lgmd_gym.envs.families.scenario import (
    AFTERMATH,
    EGO_WIDTH,
    START_TTC,
    TARGET_HEIGHT,
    TARGET_LENGTH,
    Actor,
    Scenario,
)
from lgmd_gym.errors import check_within


@family("StandingBox")
def approach_box(
    ego_speed: float = 50 * KMH,
    width: float = 1.2,
    height: float = TARGET_HEIGHT,
    length: float = TARGET_LENGTH,
    lateral_offset: float = 0.0,
    shade: int | None = None,
) -> Scenario:
    """The ego approaches a box that stands in its lane. It is not a case of a protocol.

    Args:
        ego_speed: Ego speed, in (0, 40] [m/s].
        width: Width of the box, in [0.2, 4] [m].
        height: Height of the box, in [0.2, 4] [m].
        length: Length of the box, in [0.2, 20] [m].
        lateral_offset: Centre of the box minus the ego's centreline, + left, in [-(0.85 + width / 2),
            0.85 + width / 2], so that it is in the ego's way [m].
        shade: Grey level of the box in [0, 255]; None to draw it from the seed.
    """
    speed = check_speed("ego_speed", ego_speed)
    box_width = check_within("width", width, 0.2, 4.0, "m")
    beside = (EGO_WIDTH + box_width) / 2 - 0.05
    box = Actor(
        gap=START_TTC * speed,
        lateral_offset=check_within("lateral_offset", lateral_offset, -beside, beside, "m"),
        kind="box",
        shade=shade,
        length=check_within("length", length, 0.2, 20.0, "m"),
        width=box_width,
        height=check_within("height", height, 0.2, 4.0, "m"),
    )
    duration = START_TTC + AFTERMATH
    return Scenario(family="StandingBox", ego_speed=speed, duration=duration, actors=(box,))
