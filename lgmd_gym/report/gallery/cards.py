"""The scenarios of the gallery and their videos."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from PIL import Image

from lgmd_gym.agents import make_agent
from lgmd_gym.clips import VideoWriter
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.envs.registration import RANDOM_TASKS, RandomTask
from lgmd_gym.envs.traffic.registration import KINDS, find_kind
from lgmd_gym.errors import check_known
from lgmd_gym.rendering.playback import make_target
from lgmd_gym.rendering.view import LGMDView
from lgmd_gym.report.gallery.docstrings import ParsedDocstring, parse_docstring

SCALE = 2  # factor by which the rendered pictures are reduced
FRAME_SKIP = 2  # decisions per video frame
TRAFFIC_SECONDS = 15.0
QUALITY = 5.0  # of `VideoWriter`


@dataclass(frozen=True, slots=True)
class ScenarioCard:
    """One scenario or kind of traffic in the gallery.

    Attributes:
        name: Scenario family, name in `RANDOM_TASKS` or kind of traffic.
        target: Argument of `lgmd-gym drive`.
        docstring: Docstring of the scenario.
        traffic: Whether it is a kind of traffic, in which single episodes are not evaluated.
        arguments: Arguments of the environment.
    """

    name: str
    target: str
    docstring: ParsedDocstring
    traffic: bool = False
    arguments: Mapping[str, Any] = field(default_factory=dict)


def scenario_cards(names: tuple[str, ...] = ()) -> list[ScenarioCard]:
    """Return the cards with the given names, or all.

    Raises:
        ValueError: For an unknown name, with the nearest known one.
    """
    cards = {name: ScenarioCard(name, env_id(name), parse_docstring(FAMILIES[name])) for name in FAMILIES}
    for name, task in RANDOM_TASKS.items():
        cards[name] = ScenarioCard(name, env_id(name), _docstring_of(task))
    for kind in KINDS:
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
