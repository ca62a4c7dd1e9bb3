"""Images as data URIs: figures, and camera frames of an episode."""

import base64
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import make_env, rollout
from lgmd_gym.benchmark.metrics import brake_onset
from lgmd_gym.benchmark.task import Task
from lgmd_gym.processes.files import complete_file


class CapturedFrame(NamedTuple):
    """Camera frame as a data URI, and its caption."""

    uri: str
    caption: str


def save_figure(file: Path, draw: Callable[[BinaryIO], Any]) -> str:
    """Write the SVG that a function draws to a file, and return it as a data URI."""
    drawn = io.BytesIO()
    draw(drawn)
    with complete_file(file) as part:
        part.write_bytes(drawn.getvalue())
    return _data_uri("image/svg+xml", lambda copy: copy.write(drawn.getvalue()))


def frame_uri(frame: np.ndarray) -> str:
    """Return a grey frame, uint8 of shape (height, width), as the data URI of a PNG."""
    from PIL import Image

    image = Image.fromarray(frame)
    return _data_uri("image/png", lambda file: image.save(file, "PNG", optimize=True))


def _data_uri(kind: str, write: Callable[[BinaryIO], Any]) -> str:
    file = io.BytesIO()
    write(file)
    return f"data:{kind};base64,{base64.b64encode(file.getvalue()).decode()}"


def key_decisions(series: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Return the indices of the start, the first alert, the onset of braking and the end, by caption."""
    alerts = np.flatnonzero(series["alert"])
    onset = brake_onset(series["deceleration"])
    decisions = {"start": 0}
    if alerts.size:
        decisions["first alert"] = int(alerts[0])
    if onset is not None:
        decisions["braking begins"] = onset
    return decisions | {"end": len(series["time"]) - 1}


def capture_frames(task: Task, decisions: Mapping[str, int]) -> list[CapturedFrame]:
    """Repeat an episode and return frames of the first camera.

    Args:
        task: The episode, without an FCW driver.
        decisions: Index of the decision of each frame, by caption.
    """
    actor = make_agent(task.agent)
    env = make_env(task.case, task.sensor_config.for_agent(actor), task.arguments)
    frames, last = [], max(decisions.values())
    try:
        for decision, (step, _) in enumerate(rollout(env, actor, task.seed)):
            if labels := [label for label, index in decisions.items() if index == decision]:
                time = decision / env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
                gap = f", gap {step.info['gap']:.1f} m" if np.isfinite(step.info["gap"]) else ""
                frame = next(iter(env.get_wrapper_attr("frames").values()))
                frames.append(CapturedFrame(frame_uri(frame), f"{' / '.join(labels)}: {time:.2f} s{gap}"))
            if decision == last:
                break
    finally:
        env.close()
    return frames
