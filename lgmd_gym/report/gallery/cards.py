"""Scenarios of the gallery: their docstrings, videos and single camera frames."""

import inspect
import re
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, cast

import gymnasium as gym
import numpy as np
from docstring_parser import DocstringStyle, parse
from PIL import Image

from lgmd_gym.agents import make_agent
from lgmd_gym.aliases import Arguments
from lgmd_gym.camera import WEATHERS, EgoCamera
from lgmd_gym.clips import VideoWriter
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.envs.registration import RANDOM_TASKS, TRAFFIC_KINDS, RandomTask, find_kind
from lgmd_gym.errors import check_known
from lgmd_gym.rendering.playback import make_target
from lgmd_gym.rendering.view import LGMDView


class DocumentedArgument(NamedTuple):
    """One argument in a docstring."""

    name: str  # name of the argument
    default: str  # default value as code; empty without one
    text: str  # description


class ParsedDocstring(NamedTuple):
    """A Google-style docstring."""

    summary: str  # the first line
    text: str  # following paragraphs, in Markdown
    arguments: tuple[DocumentedArgument, ...]  # documented arguments in the order of the signature


def parse_docstring(item: Any) -> ParsedDocstring:
    """Return the parsed docstring of a function or class.

    Raises:
        ValueError: If it has no docstring.
    """
    doc = inspect.getdoc(item)
    if not doc:
        raise ValueError(f"{item!r} has no docstring; write one")
    parsed = parse(doc, DocstringStyle.GOOGLE)
    texts = {param.arg_name: " ".join((param.description or "").split()) for param in parsed.params}
    arguments = [
        DocumentedArgument(name, _default(parameter), texts[name])
        for name, parameter in inspect.signature(item).parameters.items()
        if name in texts
    ]
    text = re.sub(r"^#+ *Arguments *$", "", parsed.long_description or "", flags=re.MULTILINE)
    return ParsedDocstring(parsed.short_description or "", text.strip(), tuple(arguments))


def _default(parameter: inspect.Parameter) -> str:
    """Return a default value as code, with floats shortened; empty without one."""
    value = parameter.default
    if value is inspect.Parameter.empty:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else repr(value)


SCALE = 2  # factor by which the rendered pictures are reduced
FRAME_SKIP = 2  # decisions per video frame
TRAFFIC_SECONDS = 15.0
QUALITY = 5.0  # of `VideoWriter`


@dataclass(frozen=True, slots=True)
class ScenarioCard:
    """One scenario or kind of traffic in the gallery."""

    name: str  # scenario family, name in `RANDOM_TASKS` or kind of traffic
    target: str  # argument of `lgmd-gym drive`
    docstring: ParsedDocstring  # docstring of the scenario
    traffic: bool = False  # whether it is a kind of traffic, in which single episodes are not evaluated
    arguments: Arguments = field(default_factory=Arguments)  # arguments of the environment


def scenario_cards(names: tuple[str, ...] = ()) -> list[ScenarioCard]:
    """Return the cards with the given names, or all.

    Raises:
        ValueError: For an unknown name, with the nearest known one.
    """
    cards = {name: ScenarioCard(name, env_id(name), parse_docstring(FAMILIES[name])) for name in FAMILIES}
    for name, task in RANDOM_TASKS.items():
        cards[name] = ScenarioCard(name, env_id(name), _docstring_of(task))
    for kind in TRAFFIC_KINDS:
        cards[kind] = ScenarioCard(kind, f"traffic/{kind}", parse_docstring(find_kind(kind)), traffic=True)
    for name in names:
        check_known("scenario family or kind of traffic", name, cards)
    return [card for name, card in cards.items() if not names or name in names]


def _docstring_of(task: RandomTask) -> ParsedDocstring:
    """Return the docstring of `RandomLevels` with the summary and the default arguments of a task."""
    docstring = parse_docstring(RandomLevels)
    arguments = (
        item._replace(default=repr(task.arguments[item.name])) if item.name in task.arguments else item
        for item in docstring.arguments
    )
    return docstring._replace(summary=task.summary, arguments=tuple(arguments))


def record_video(card: ScenarioCard, agent_name: str, stem: Path) -> None:
    """Record an episode with seed 0 as `stem`.mp4, and its frame of highest spike frequency as `stem`.jpg."""
    agent = make_agent(agent_name)
    env = LGMDView(make_target(card.target, dict(card.arguments)), title=f"{card.target}   {agent.name}")
    rate = env.metadata["render_fps"]
    max_decisions = round(TRAFFIC_SECONDS * rate) if card.traffic else None
    observation, info = env.reset(seed=0)
    agent.reset(0)
    still, highest, decisions, done = None, -1.0, 0, False
    with VideoWriter(stem.with_suffix(".mp4"), rate / FRAME_SKIP, QUALITY) as writer:
        while not done:
            action = agent.act(observation, info)
            env.agent_alert = agent.alert
            if decisions % FRAME_SKIP == 0:
                picture = cast(np.ndarray, env.render())
                writer.write(_reduce(picture))
                # Frames of the first second rank lower. Without spikes, the frame at four seconds is used.
                frequency = float(observation["spike_frequency"].max()) - (decisions < rate)
                if frequency > highest or (highest <= 0.0 and decisions == 4 * rate):
                    still, highest = picture, frequency
            observation, _, terminated, truncated, info = env.step(action)
            decisions += 1
            done = terminated or truncated or decisions == max_decisions
        env.agent_alert = agent.alert
        for _ in range(round(rate / FRAME_SKIP)):  # hold the last picture for one second
            writer.write(_reduce(cast(np.ndarray, env.render())))
    env.close()
    assert still is not None
    Image.fromarray(still).save(stem.with_suffix(".jpg"), quality=82)


def _reduce(picture: np.ndarray) -> np.ndarray:
    """Return a picture reduced by `SCALE`, averaged over blocks of pixels."""
    height, width = picture.shape[0] // SCALE, picture.shape[1] // SCALE
    blocks = picture.reshape(height, SCALE, width, SCALE, 3)
    return blocks.mean(axis=(1, 3), dtype=np.float32).astype(np.uint8)


# Environment id -> seed and number of simulation steps after which vehicles are in view.
ROADS = {
    "highway-v0": (1, 30),
    "merge-v0": (0, 60),
    "roundabout-v0": (0, 60),
    "intersection-v0": (2, 40),
    "racetrack-v0": (3, 15),
    "exit-v0": (1, 30),
    "two-way-v0": (0, 45),
    "lane-keeping-v0": (0, 15),
    "u-turn-v0": (0, 30),
    "parking-v0": (2, 10),
}
CAMERAS = ("wide", "standard", "tele", "fovea")
APPROACH_DECISIONS = 90  # decisions of an approach at 8 m/s, after which the target is 16 m ahead


def road_sheet(roads: tuple[str, ...], weathers: tuple[str, ...]) -> dict[str, dict[str, np.ndarray]]:
    """Return frames of the wide camera by road and condition, uint8, shape (height, width)."""
    cameras = {name: EgoCamera("wide", {"weather": name}) for name in weathers}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # highway-env's warnings about its own spaces and versions
        return {env_id: _road_frames(env_id, cameras) for env_id in roads}


def camera_sheet() -> dict[str, dict[str, np.ndarray]]:
    """Return frames of the same approach by camera preset and condition, uint8, shape (height, width)."""
    env: Any = gym.make("LGMD/CCRs-v0", ego_speed=8.0, shade=60, camera=None)
    env.reset(seed=0)
    for _ in range(APPROACH_DECISIONS):
        env.step([0.0])
    return {
        preset: {name: EgoCamera(preset, {"weather": name}).render(env) for name in WEATHERS}
        for preset in CAMERAS
    }


def _road_frames(env_id: str, cameras: dict[str, EgoCamera]) -> dict[str, np.ndarray]:
    """Return one frame per camera after some simulation steps without steering or braking."""
    import highway_env  # noqa: F401  (registers the environments)  # pyright: ignore[reportUnusedImport]

    seed, steps = ROADS[env_id]
    config = {"simulation_frequency": 30, "policy_frequency": 30}
    if env_id in ("highway-v0", "exit-v0"):
        config["vehicles_count"] = 8
    env: Any = gym.make(env_id, config=config).unwrapped
    env.reset(seed=seed)
    for _ in range(steps):
        env.road.act()
        env.road.step(1 / 30)
        env.steps += 1
    frames = {name: camera.render(env) for name, camera in cameras.items()}
    env.close()
    return frames
