"""The simulated drives that are compared with real clips."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from lgmd_gym.camera import Camera
from lgmd_gym.camera.worlds import LABORATORY

GROUPS = {
    "day": ("clear", "clear", "clear", "rain", "clear", "clear", "low_sun"),
    "night": ("night",),
}
"""Camera conditions of the drives of each group, in turn; the laboratory has the first one only.

Of four real clips by day, three have clear weather and one a grey sky; none has fog. Seven has no common
factor with the number of environments or with twenty worlds: given enough seeds, each occurs with each
condition.
"""
MAX_SECONDS = 5.0  # of a drive; real clips have 2 to 10 s before the crash


class Optics(NamedTuple):
    """Frames of real clips and of the simulated drives.

    Attributes:
        shape: (height, width) [px].
        fps: Frame rate, a whole number [Hz].
        hfov_deg: Horizontal field of view [degrees].
        ignored_bottom: Share of the height, at the bottom, that statistics of the whole frame leave out:
            bonnets and captions.
    """

    shape: tuple[int, int]
    fps: int
    hfov_deg: float
    ignored_bottom: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Drives:
    """Simulated drives of one environment that differ in their seeds.

    Attributes:
        env: Environment id.
        arguments: Arguments of `gym.make`: of the scenario family, `world`, `weather` and `road`.
        camera: Fields of `Camera`.
        seeds: Seeds, one drive each.
        group: Group of real clips with which the drives are compared.
    """

    env: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    camera: Mapping[str, Any] = field(default_factory=dict)
    seeds: Sequence[int] = (0,)
    group: str = "day"

    @property
    def label(self) -> str:
        """Environment and arguments in one line."""
        values = [f"{name}={value}" for name, value in (*self.arguments.items(), *self.camera.items())]
        return " ".join((self.env.removeprefix("LGMD/").removesuffix("-v0"), *values))


ROADS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("LGMD/Following-v0", {"ego_speed": 13.9}),
    ("LGMD/Following-v0", {"ego_speed": 25.0}),
    ("LGMD/CCRb-v0", {}),
    ("LGMD/AdjacentPass-v0", {}),
    ("LGMD/Oncoming-v0", {}),
    ("LGMD/CutIn-v0", {}),
    ("LGMD/Traffic-Highway-v0", {}),
    ("LGMD/Traffic-TwoWay-v0", {}),
    ("LGMD/Traffic-Intersection-v0", {}),
)
"""Environments and arguments of `simulated_drives`: an ego among other vehicles."""


def simulated_drives(
    worlds: Sequence[int],
    seeds: Sequence[int],
    arguments: Mapping[str, Any] | None = None,
    camera: Mapping[str, Any] | None = None,
) -> list[Drives]:
    """Return drives on `ROADS` by day and at night, each with one world and one weather of its group.

    Worlds and weathers follow each other in turn: the drives of a group have as many worlds as possible.

    Args:
        worlds: Numbers of the worlds; empty for the laboratory.
        seeds: Seeds of every environment and group.
        arguments: Further arguments of every environment.
        camera: Further camera fields of every drive.
    """
    drives = []
    for group, weathers in GROUPS.items():
        for index, (seed, (env, own)) in enumerate(product(seeds, ROADS)):
            appearance = {
                "world": worlds[index % len(worlds)] if worlds else LABORATORY,
                "weather": weathers[index % len(weathers)] if worlds else weathers[0],
            }
            drives.append(
                Drives(env=env, arguments={**own, **appearance, **(arguments or {})}, camera=camera or {},
                       seeds=(seed,), group=group)
            )  # fmt: skip
    return drives


def drive_frames(drives: Drives, seed: int, optics: Optics) -> Iterator[np.ndarray]:
    """Yield the camera frames of a drive without braking, uint8, shape (H, W), until its end or 5 s.

    Args:
        drives: The environment.
        seed: Seed of the environment.
        optics: Size, rate and field of view of the frames.
    """
    camera = Camera.make(
        {"name": "clip", "shape": optics.shape, "hfov_deg": optics.hfov_deg, **drives.camera}
    )
    rates = {"policy_frequency": optics.fps, "simulation_frequency": 2 * optics.fps}
    arguments = dict(drives.arguments)
    config = {**rates, **arguments.pop("config", {})}
    env = gym.make(drives.env, camera=camera, fps=optics.fps, include_frame=True, config=config, **arguments)
    try:
        observation, _ = env.reset(seed=seed)
        hold = np.zeros(1, np.float32)
        for _ in range(round(MAX_SECONDS * optics.fps)):
            yield observation["frame"][:, :, 0]
            observation, _, terminated, truncated, _ = env.step(hold)
            if terminated or truncated:
                return
    finally:
        env.close()
