"""The scenes of the gallery: a film each, and what the agents make of it."""

from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from PIL import Image

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.task import NO_BRAKE, Task, run_task
from lgmd_gym.envs import FAMILIES, env_id
from lgmd_gym.envs.random_braking import RandomBrakingEnv
from lgmd_gym.envs.registration import RANDOM
from lgmd_gym.envs.traffic.registration import KINDS, find_kind
from lgmd_gym.errors import unknown_name
from lgmd_gym.gallery.docstrings import About, read
from lgmd_gym.rendering.playback import make_target
from lgmd_gym.rendering.view import LGMDView
from lgmd_gym.video import VideoWriter

SHRINK = 2  # a film has half of the composed picture's width and height
EVERY = 2  # decisions per picture of a film
TRAFFIC_SECONDS = 15.0
QUALITY = 5.0  # of `VideoWriter`


@dataclass(frozen=True, slots=True)
class Scene:
    """One card of the gallery.

    Attributes:
        name: The family, "RandomBraking", or the kind of traffic.
        target: What `lgmd-gym drive` calls it.
        about: Its docstring.
        judged: Whether single episodes tell who is right; in traffic only many kilometres do.
    """

    name: str
    target: str
    about: About
    judged: bool = True


def find_scenes(names: tuple[str, ...] = ()) -> list[Scene]:
    """Return the scenes of these names, or all.

    Raises:
        ValueError: For an unknown name; the nearest is named.
    """
    everything = {name: Scene(name, env_id(name), read(FAMILIES[name])) for name in FAMILIES}
    everything[RANDOM] = Scene(RANDOM, env_id(RANDOM), read(RandomBrakingEnv))
    for kind in KINDS:
        everything[kind] = Scene(kind, f"traffic/{kind}", read(find_kind(kind)), judged=False)
    for name in names:
        if name not in everything:
            raise unknown_name("scenario family or kind of traffic", name, everything)
    return [scene for name, scene in everything.items() if not names or name in names]


def film(scene: Scene, agent_name: str, stem: Path) -> None:
    """Play a scene with seed 0; write its film to `stem`.mp4, a still of its liveliest moment to .jpg."""
    agent = make_agent(agent_name)
    env = LGMDView(make_target(scene.target, {}), title=f"{scene.target}   {agent.name}")
    rate = env.metadata["render_fps"]
    limit = round(TRAFFIC_SECONDS * rate) if not scene.judged else None
    observation, info = env.reset(seed=0)
    agent.reset(0)
    still, liveliest, decisions, done = None, -1.0, 0, False
    with VideoWriter(stem.with_suffix(".mp4"), rate / EVERY, QUALITY) as writer:
        while not done:
            action = agent.act(observation, info)
            env.agent_alert = agent.alert
            if decisions % EVERY == 0:
                picture = env.render()
                writer.write(_smaller(picture))
                life = float(observation["spike_frequency"].max()) + (decisions < rate) * -1.0
                if life > liveliest or (liveliest <= 0.0 and decisions == 4 * rate):
                    still, liveliest = picture, life
            observation, _, terminated, truncated, info = env.step(action)
            decisions += 1
            done = terminated or truncated or decisions == limit
        env.agent_alert = agent.alert
        for _ in range(round(rate / EVERY)):
            writer.write(_smaller(env.render()))
    env.close()
    assert still is not None
    Image.fromarray(still).save(stem.with_suffix(".jpg"), quality=82)


def judge(scene: Scene, agents: list[str], seeds: int) -> dict[str, str]:
    """Return, by agent, what came of a scene in words; empty for one that single episodes do not judge."""
    if not scene.judged:
        return {}
    case = Case(f"gallery/{scene.name}/default", scene.name, ())
    truths = [run_task(Task(NO_BRAKE, case, seed, SensorConfig())) for seed in range(seeds)]
    words = {NO_BRAKE: say([result.row for result in truths])}
    for agent in agents:
        if agent != NO_BRAKE:
            tasks = [
                Task(agent, case, seed, SensorConfig(), truth.counterfactual) for seed, truth in enumerate(truths)
            ]
            words[agent] = say([run_task(task).row for task in tasks])
    return words


def say(rows: list[dict[str, Any]]) -> str:
    """Return the outcome of an agent's rows in words, with the number of episodes."""
    if any(row["error"] is not None for row in rows):
        return "failed"
    threats = [row for row in rows if row["threat"]]
    quiet = [row for row in rows if not row["threat"]]
    words = []
    if threats:
        words.append(f"avoided {sum(row['avoided'] for row in threats)}/{len(threats)}")
        hits = [3.6 * row["relative_impact_speed"] for row in threats if row["collision"]]
        if hits:
            words.append(f"contact at {median(hits):.0f} km/h")
        if any(row["premature_brake"] for row in threats):
            words.append("braked too early")
    if quiet:
        needless = sum(row["false_activation"] for row in quiet)
        touched = sum(row["collision"] for row in quiet)
        words.append(f"needless braking {needless}/{len(quiet)}")
        if touched:
            words.append(f"contact {touched}/{len(quiet)}")
    return ", ".join(words)


def _smaller(picture: np.ndarray) -> np.ndarray:
    """Return a picture with every `SHRINK` × `SHRINK` pixels averaged."""
    height, width = picture.shape[0] // SHRINK, picture.shape[1] // SHRINK
    blocks = picture.reshape(height, SHRINK, width, SHRINK, 3)
    return blocks.mean(axis=(1, 3), dtype=np.float32).astype(np.uint8)
