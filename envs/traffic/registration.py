"""Traffic for counting needless brakes: highway-env's roads and cars, an IDM driver, and an agent's brake."""

from typing import Any

import gymnasium as gym

from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.envs.traffic.kinds import (
    HighwayTraffic,
    IntersectionTraffic,
    MergeTraffic,
    RoundaboutTraffic,
    TwoWayTraffic,
)
from lgmd_gym.errors import unknown_name

KINDS: dict[str, type[TrafficEnv]] = {
    "highway": HighwayTraffic,
    "merge": MergeTraffic,
    "two-way": TwoWayTraffic,
    "intersection": IntersectionTraffic,
    "roundabout": RoundaboutTraffic,
}


def find_kind(kind: str) -> type[TrafficEnv]:
    """Return the environment of a kind of traffic, or raise ValueError that names the nearest kind."""
    if kind not in KINDS:
        raise unknown_name("kind of traffic", kind, KINDS)
    return KINDS[kind]


def make_traffic(
    kind: str = "highway",
    camera: Any = "fovea",
    params: Any = None,
    fps: float | None = None,
    include_frame: bool = False,
    include_base: bool = False,
    trace: bool = False,
    config: dict[str, Any] | None = None,
    render_mode: str | None = None,
) -> gym.Env:
    """Return traffic of a kind inside `LGMDObservation`, or bare for `camera=None`.

    Args:
        kind: A name in `KINDS`.
        camera: See `LGMDObservation`; None for no eye.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        config: Configuration of `TrafficEnv`.
        render_mode: None, "rgb_array" or "human".

    Raises:
        ValueError: For an unknown kind, key or name (the nearest is named), or a value out of its range.
    """
    env = find_kind(kind)(config=config, render_mode=render_mode)
    if camera is None:
        return env
    from lgmd_gym.wrappers.observation import LGMDObservation

    return LGMDObservation(
        env,
        camera=camera,
        params=params,
        fps=fps,
        include_frame=include_frame,
        include_base=include_base,
        trace=trace,
    )
