# pyright: standard
# Not strict: highway-env states few types.
"""Camera frames of an episode that is played again: a wide view with the fields of the agent drawn in."""

import base64
import io
from collections.abc import Mapping
from typing import NamedTuple

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import make_env, rollout, with_config
from lgmd_gym.benchmark.metrics import brake_onsets
from lgmd_gym.benchmark.task import Task
from lgmd_gym.camera import Camera, EgoCamera

WIDE = Camera(name="report", shape=(180, 320), hfov_deg=60.0)
FIELD_COLOUR = "#E69F00"
FIELD_M = 60.0  # distance at which the corners of a field are drawn [m]


class CapturedFrame(NamedTuple):
    """Camera frame as a data URI, and its caption."""

    uri: str
    caption: str


def data_uri(kind: str, data: bytes) -> str:
    """Return data as a URI of a media type."""
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def key_decisions(series: Mapping[str, np.ndarray]) -> dict[str, int]:
    """Return the indices of the start, the first alert, the onset of braking and the end, by caption."""
    alerts = np.flatnonzero(series["alert"])
    onset = next(iter(brake_onsets(series["deceleration"])), None)
    decisions = {"start": 0}
    if alerts.size:
        decisions["first alert"] = int(alerts[0])
    if onset is not None:
        decisions["braking begins"] = onset
    return decisions | {"end": len(series["time"]) - 1}


def capture_frames(task: Task, decisions: Mapping[str, int]) -> list[CapturedFrame]:
    """Repeat an episode and return wide frames with the fields of the agent's cameras.

    Args:
        task: The episode, without an FCW driver.
        decisions: Index of the decision of each frame, by caption.
    """
    actor = make_agent(task.agent)
    arguments = with_config(task.arguments, actor.config)
    env = make_env(task.case, task.sensor_config.for_agent(actor), arguments)
    frames, last = list[CapturedFrame](), max(decisions.values())
    try:
        for decision, (step, _) in enumerate(rollout(env, actor, task.seed)):
            if labels := [label for label, index in decisions.items() if index == decision]:
                time = decision / env.unwrapped.config["policy_frequency"]  # type: ignore[attr-defined]
                gap = f", gap {step.info['gap']:.1f} m" if np.isfinite(step.info["gap"]) else ""
                frames.append(CapturedFrame(frame_uri(env), f"{' / '.join(labels)}: {time:.2f} s{gap}"))
            if decision == last:
                break
    finally:
        env.close()
    return frames


def frame_uri(env: gym.Env) -> str:
    """Return the present view of the road with the outlines of all fields, as the data URI of a picture.

    An environment with a top view only has no fields: the picture is its frame.
    """
    from PIL import Image, ImageDraw

    cameras = env.get_wrapper_attr("sensors").cameras[0].values()
    posed = [camera for camera in cameras if isinstance(camera, EgoCamera)]
    if posed:
        view = EgoCamera(WIDE, posed[0].scene)
        picture = Image.fromarray(view.render(env)).convert("RGB")
        drawing = ImageDraw.Draw(picture)
        for corners in (view.project(camera.corners(FIELD_M)) for camera in posed):
            if np.isfinite(corners).all():
                drawing.polygon([(float(u), float(v)) for u, v in corners], outline=FIELD_COLOUR)
    else:
        picture = Image.fromarray(next(iter(env.get_wrapper_attr("frames").values())))
    file = io.BytesIO()
    picture.save(file, "JPEG", quality=80, subsampling=0)  # thin coloured lines
    return data_uri("image/jpeg", file.getvalue())
