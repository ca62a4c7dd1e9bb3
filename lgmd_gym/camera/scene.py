"""State of a highway-env environment at one camera frame."""

import math
from typing import Any, NamedTuple


class SceneState(NamedTuple):
    """Road, ego car and clock of an environment.

    Attributes:
        road: The highway-env `Road`.
        ego: The vehicle that carries the cameras.
        x: Centre of the ego along world x [m].
        y: Centre of the ego along world y [m].
        heading: Heading of the ego [rad].
        steps: Simulation steps since the reset.
        time_s: Simulated time since the reset [s].
    """

    road: Any
    ego: Any
    x: float
    y: float
    heading: float
    steps: int
    time_s: float


def scene_of(env: Any) -> SceneState:
    """Return the present state of a highway-env environment, wrapped or not.

    An environment without `steps` or `config` is at time 0.

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
    rate = (getattr(base, "config", None) or {}).get("simulation_frequency", 30)
    return SceneState(road, ego, x, y, heading, steps, steps / rate)
