"""State of highway-env environments at one camera frame, as arrays."""

import math
import struct
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lgmd_gym.aliases import Config

if TYPE_CHECKING:
    import gymnasium as gym
    from highway_env.road.road import Road
    from highway_env.vehicle.kinematics import Vehicle


SCENE = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "heading", "speed", "steering", "acceleration")),
        *(("length", np.float64), ("time_s", np.float64), ("steps", np.int64)),
    ]
)
"""The ego and the clock: centre [m], heading [rad], speed [m/s], steering angle [rad] and acceleration [m/s²]
of its action, length [m], simulated time since the reset [s], simulation steps since the reset."""
_RECORD = struct.Struct("=8dq")  # packing is twice as fast as assigning a record


class Ego(NamedTuple):
    """Road and ego of an environment, and the pose of the ego [m, rad]."""

    road: "Road"
    vehicle: "Vehicle"
    x: float
    y: float
    heading: float


def read_scene(env: "gym.Env", scenes: memoryview, index: int = 0) -> Ego:
    """Read the present state of a highway-env environment, wrapped or not.

    An environment without `steps` or `config` is at time 0.

    Args:
        env: The environment, after its first reset.
        scenes: Bytes of `SCENE` records.
        index: Index of the record to write.

    Raises:
        ValueError: If the environment has no road or no ego, or the ego's pose is not finite.
    """
    base = getattr(env, "unwrapped", env)
    road, ego = getattr(base, "road", None), getattr(base, "vehicle", None)
    if road is None:
        raise ValueError("the environment has no road: call reset() before render()")
    if ego is None:
        raise ValueError("the environment has no ego vehicle (env.unwrapped.vehicle is None)")
    x, y, heading = float(ego.position[0]), float(ego.position[1]), float(ego.heading)
    if not math.isfinite(x + y + heading):
        raise ValueError(f"the ego vehicle has position ({x}, {y}) and heading {heading}")
    steps = int(getattr(base, "steps", 0) or 0)
    config: Config = getattr(base, "config", None) or {}
    rate = config.get("simulation_frequency", 30)
    action: dict[str, float] = getattr(ego, "action", None) or {}
    _RECORD.pack_into(
        scenes, index * _RECORD.size,
        x, y, heading, ego.speed, action.get("steering", 0.0), action.get("acceleration", 0.0), ego.LENGTH,
        steps / rate, steps,
    )  # fmt: skip
    return Ego(road, ego, x, y, heading)
