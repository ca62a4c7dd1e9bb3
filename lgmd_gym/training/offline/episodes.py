"""Drives without braking, recorded once, and what braking would have brought at every one of their decisions.

With a brake that latches, an episode is a drive up to one decision. So one drive holds all that a policy can
see before it brakes, and copies without sensors tell what braking at each of its decisions leads to.
"""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from typing import Any

import gymnasium as gym
import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents.base import HOLD
from lgmd_gym.agents.policies.features import FRAME, SCALES, shrink_frame
from lgmd_gym.training.config import Plan
from lgmd_gym.training.offline.onsets import STRIDE, Outcome, outcomes

BLIND = {"name": "wide", "shape": [8, 8]}  # the eye of the twin, never opened


@dataclass(frozen=True)
class Drive:
    """One drive without braking, of T decisions of the environment.

    A policy may decide at any of them, so that policies of every pace learn from the same drives.

    Attributes:
        seen: The environment's observations by name, (T, n) each.
        frames: Camera frames, shrunk already, uint8 (T, height, width, channels); None if not wanted.
        rewards: Reward of holding the speed for each decision, float32 (T,).
        returns: Return of braking at each decision, from there on, float32 (T,).
        contacts: Whether that ends in a contact, bool (T,).
        threat: Whether the drive itself ended in a contact.
    """

    seen: dict[str, np.ndarray]
    frames: np.ndarray | None
    rewards: np.ndarray
    returns: np.ndarray
    contacts: np.ndarray
    threat: bool

    def __len__(self) -> int:
        return len(self.rewards)


class Moments:
    """What is seen at the decisions of a drive, as it is kept.

    Args:
        plan: Of the training.
    """

    def __init__(self, plan: Plan) -> None:
        self._seen: list[dict[str, np.ndarray]] = []
        self._frames: list[np.ndarray] = []
        self._shrink = plan.features["shrink"] if FRAME in plan.features["inputs"] else None

    def __len__(self) -> int:
        return len(self._seen)

    def add(self, observation: dict[str, np.ndarray]) -> None:
        """Keep an observation."""
        self._seen.append({name: observation[name] for name in SCALES})
        if self._shrink is not None:
            self._frames.append(shrink_frame(observation[FRAME], self._shrink))

    def arrays(self) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
        """Return what was seen by name, and the frames if they are wanted."""
        seen = {name: np.stack([moment[name] for moment in self._seen]) for name in SCALES}
        return seen, np.stack(self._frames) if self._frames else None


def record(plan: Plan, split: str, seeds: range, jobs: int, tell: Callable[[int], Any]) -> list[Drive]:
    """Record one drive for each seed that an environment is reset with.

    Args:
        plan: Of a training with a brake that latches, and of two demands: to hold the speed and to brake.
        split: "train" or "validation".
        seeds: One drive each.
        jobs: Processes.
        tell: Called with the number of drives that have been added.
    """
    size = max(min(len(seeds) // (4 * jobs), 20), 1)
    parts = [seeds[start : start + size] for start in range(0, len(seeds), size)]
    told: Any = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_record_some)(plan, split, part) for part in parts
    )
    drives: list[Drive] = []
    for some in told:
        drives += some
        tell(len(some))
    return drives


def _record_some(plan: Plan, split: str, seeds: range) -> list[Drive]:
    sighted, twin = plan.make_plain(split), replace(plan, camera=BLIND).make_plain(split)
    try:
        return [_drive(plan, sighted, twin.unwrapped, seed) for seed in seeds]
    finally:
        sighted.close()
        twin.close()


def _drive(plan: Plan, sighted: gym.Env, twin: Any, seed: int) -> Drive:
    """Drive an environment, and a twin that no eye watches, so that it can be copied and braked at will."""
    hold, brake = plan.demands.index(HOLD), plan.demands.index(min(plan.demands))
    moments, copies, rewards, done = Moments(plan), [], [], False
    observation, info = sighted.reset(seed=seed)
    twin.reset(seed=seed)
    while not done:
        if len(moments) % STRIDE == 0:
            copies.append(deepcopy(twin))
        moments.add(observation)
        observation, reward, terminated, truncated, info = sighted.step(hold)
        twin.step(hold)
        rewards.append(float(reward))
        done = terminated or truncated

    def replay(onset: int) -> Outcome:
        env = deepcopy(copies[onset // STRIDE])
        for _ in range(onset % STRIDE):
            env.step(hold)
        return _braked(env, brake)

    found = outcomes(len(moments), replay)
    return Drive(
        *moments.arrays(),
        np.array(rewards, np.float32),
        np.array([item.ret for item in found], np.float32),
        np.array([item.contact for item in found]),
        bool(info["collision"]),
    )


def _braked(env: Any, brake: int) -> Outcome:
    ret, done, info = 0.0, False, {}
    while not done:
        _, reward, terminated, truncated, info = env.step(brake)
        ret, done = ret + float(reward), terminated or truncated
    return Outcome(ret, bool(info["collision"]))
