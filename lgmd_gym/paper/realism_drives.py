"""The simulated drives that `lgmd-gym paper --realism` compares with real clips."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from lgmd_gym.camera import CameraParams

GROUPS = {"day": "clear", "night": "night"}  # camera condition of each group
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
        arguments: Arguments of `gym.make`, for example of the scenario family.
        camera: Fields of `CameraParams`, and optionally `condition`.
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
"""Environments and arguments of `laboratory_drives`: an ego among other vehicles."""


def laboratory_drives(
    seeds: Sequence[int],
    arguments: Mapping[str, Any] | None = None,
    camera: Mapping[str, Any] | None = None,
) -> list[Drives]:
    """Return drives on `ROADS`, each by day and at night.

    Args:
        seeds: Seeds of every environment and condition.
        arguments: Further arguments of every environment.
        camera: Further camera fields of every drive; they override those of the condition.
    """
    return [
        Drives(
            env=env, arguments={**own, **(arguments or {})},
            camera={"condition": condition, **(camera or {})}, seeds=seeds, group=group,
        )
        for group, condition in GROUPS.items()
        for env, own in ROADS
    ]  # fmt: skip


def drive_frames(drives: Drives, seed: int, optics: Optics) -> Iterator[np.ndarray]:
    """Yield the camera frames of a drive without braking, uint8, shape (H, W), until its end or 5 s.

    Args:
        drives: The environment.
        seed: Seed of the environment.
        optics: Size, rate and field of view of the frames.
    """
    camera = CameraParams.make(
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
