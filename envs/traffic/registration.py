"""Registration of the traffic environments with Gymnasium."""

from typing import TYPE_CHECKING, Any

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator

from lgmd_gym.envs.registration import env_id, with_camera
from lgmd_gym.errors import check_known

if TYPE_CHECKING:
    from lgmd_gym.camera import CameraSpec
    from lgmd_gym.envs.traffic.env import TrafficEnv
    from lgmd_gym.neuron import NeuronSpec

# Entry points rather than classes, so that registering the ids does not import highway-env.
KINDS: dict[str, str] = {
    "highway": "lgmd_gym.envs.traffic.kinds:HighwayTraffic",
    "merge": "lgmd_gym.envs.traffic.kinds:MergeTraffic",
    "two-way": "lgmd_gym.envs.traffic.kinds:TwoWayTraffic",
    "intersection": "lgmd_gym.envs.traffic.kinds:IntersectionTraffic",
    "roundabout": "lgmd_gym.envs.traffic.kinds:RoundaboutTraffic",
}


def traffic_id(kind: str) -> str:
    """Return the Gymnasium id of a kind of traffic, `LGMD/Traffic-TwoWay-v0` for "two-way"."""
    return env_id(f"Traffic-{kind.title().replace('-', '')}")


def register_traffic() -> None:
    """Register the id of every kind of traffic; idempotent."""
    for kind in KINDS:
        if traffic_id(kind) not in gym.registry:
            arguments = {"kind": kind, "split": "train"}
            gym.register(traffic_id(kind), entry_point=f"{__name__}:make_traffic", kwargs=arguments)


def find_kind(kind: str) -> "type[TrafficEnv]":
    """Return the environment class of a kind of traffic.

    Raises:
        ValueError: If the kind is unknown.
    """
    check_known("kind of traffic", kind, KINDS)
    return load_env_creator(KINDS[kind])  # type: ignore[return-value]


def make_traffic(
    kind: str,
    camera: "CameraSpec | None" = "fovea",
    params: "NeuronSpec | None" = None,
    fps: float | None = None,
    include_frame: bool = False,
    include_base: bool = False,
    trace: bool = False,
    config: dict[str, Any] | None = None,
    render_mode: str | None = None,
    world: int | str | None = None,
    condition: str = "clear",
    road: str | None = None,
    split: str = "train",
) -> gym.Env:
    """Return a traffic environment inside `LGMDObservation`, or without it for `camera=None`.

    This is the entry point of the registered ids: prefer `gym.make(traffic_id(kind), ...)`.

    Args:
        kind: A key of `KINDS`.
        camera: See `LGMDObservation`; None for no camera.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        config: Configuration of `TrafficEnv`.
        render_mode: None, "rgb_array" or "human".
        world: Number of the world, 0 to 9,999, or "laboratory"; None to draw one of the split at each reset.
        condition: Camera condition, see `lgmd_gym.camera.CONDITIONS`, or "mixed" for that of the world.
        road: See `lgmd_gym.envs.appearance.Appearance`.
        split: See `lgmd_gym.envs.appearance.Appearance`.

    Raises:
        ValueError: If a kind, key or name is unknown, or a value is out of range.
    """
    from lgmd_gym.envs.appearance import Appearance

    env = find_kind(kind)(config=config, render_mode=render_mode)
    env.appearance = Appearance(world=world, condition=condition, road=road, split=split)
    return with_camera(env, camera, params, fps, include_frame, include_base, trace)
