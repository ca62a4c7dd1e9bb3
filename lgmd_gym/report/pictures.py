"""Pictures as data URIs: figures, and what the camera saw at moments of an episode."""

import base64
import io
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.metrics import brake_onset
from lgmd_gym.benchmark.sensors import SensorConfig


class Picture(NamedTuple):
    """One camera frame: a data URI, and what stands below it."""

    uri: str
    caption: str


def figure_uri(draw: Callable[[Any], None]) -> str:
    """Return what a function draws into an open file as SVG, as a data URI."""
    file = io.BytesIO()
    draw(file)
    return f"data:image/svg+xml;base64,{base64.b64encode(file.getvalue()).decode()}"


def frame_uri(frame: np.ndarray) -> str:
    """Return a grey frame, uint8 (height, width), as a PNG's data URI."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(frame).save(file, "PNG", optimize=True)
    return f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"


def moments(series: dict[str, np.ndarray]) -> dict[str, int]:
    """Return the decisions worth a picture: start, first alert, onset of braking, end."""
    alerts = np.flatnonzero(series["alert"])
    onset = brake_onset(series["deceleration"])
    found = {"start": 0}
    if alerts.size:
        found["first alert"] = int(alerts[0])
    if onset is not None:
        found["braking begins"] = onset
    return found | {"end": len(series["time"]) - 1}


def frames_at(
    case: Case, agent: str, seed: int, sensor_config: SensorConfig, wanted: dict[str, int]
) -> list[Picture]:
    """Play an episode again and return the frames of the first camera at some decisions.

    Args:
        case: The case.
        agent: Who brakes.
        seed: Of the environment and the agent.
        sensor_config: Camera and neuron parameters; the agent's own where it is left open.
        wanted: What stands below a frame, and its decision.
    """
    player, last = make_agent(agent), max(wanted.values())
    env = make_env(case, sensor_config.of(player))
    try:
        observation, info = env.reset(seed=seed)
        player.reset(seed)
        shown: dict[int, Picture] = {}
        policy_hz = env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
        for decision in range(last + 1):
            names = [name for name, index in wanted.items() if index == decision]
            if names:
                gap = f", {info['gap']:.1f} m ahead" if np.isfinite(info["gap"]) else ""
                caption = f"{' / '.join(names)}: {decision / policy_hz:.2f} s{gap}"
                frame = next(iter(env.get_wrapper_attr("frames").values()))
                shown[decision] = Picture(frame_uri(frame), caption)
            if decision < last:
                observation, _, _, _, info = env.step(player.act(observation, info))
    finally:
        env.close()
    return list(shown.values())
