"""The info of a braking environment as a record."""

from math import inf
from typing import Any

import numpy as np

from lgmd_gym.envs.dynamics.bodies import ego_braking
from lgmd_gym.envs.dynamics.episode import speed_along_ego
from lgmd_gym.envs.surrogate_safety import contact_time, headway, lead_of, rate_to_avoid_crash
from lgmd_gym.kernels import kernel

INFO_KEYS = (
    "speed", "crashed", "ego_speed", "gap", "ttc", "thw", "drac", "required_deceleration", "collision",
    "impact_speed", "relative_impact_speed", "deceleration", "target_speed",
)  # fmt: skip
INFO = np.dtype(
    [(key, np.bool_ if key in ("crashed", "collision") else np.float64) for key in INFO_KEYS], align=True
)
"""The info of one environment; see `BrakingEnv` for meanings and units."""


@kernel(exact=True)
def write_info(
    bodies: np.ndarray, episode: np.record, ego: np.record, paths: np.ndarray, info: np.record
) -> None:
    """Write the present state of an episode to an `INFO` record.

    Args:
        bodies: `BODY` records, the ego first.
        episode: `EPISODE` record.
        ego: `EGO_STATE` record.
        paths: Table of the paths' cells.
        info: `INFO` record.
    """
    here = bodies[0]
    gap, lead = lead_of(bodies, episode.bodies, paths)
    info.speed = info.ego_speed = here.speed
    info.crashed = info.collision = episode.touched > 0
    info.gap, info.ttc = gap, contact_time(bodies, episode.bodies, paths)
    info.thw, info.drac, info.required_deceleration = headway(gap, here.speed), inf, inf
    if lead > 0:
        other: Any = bodies[lead]
        closing_speed = here.speed - speed_along_ego(here, other)
        info.drac = rate_to_avoid_crash(gap, closing_speed)
        info.required_deceleration = max(info.drac - other.acceleration, 0.0)
    info.impact_speed, info.relative_impact_speed = episode.impact_speed, episode.relative_impact_speed
    info.deceleration = ego_braking(here, ego)
    target: Any = bodies[episode.target]
    info.target_speed = target.speed if episode.target > 0 else inf
