"""Quiet driving through traffic, recorded: braking is always the fault, and needs no replays to be priced.

Levels last seconds. What they lack is long driving in which nothing happens: behind somebody, past oncoming
cars, setting off. A drive through traffic is cut into pieces; those are kept in which no emergency is near.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents.base import HOLD, to_action
from lgmd_gym.agents.policies.features import FRAME
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.envs.scenarios.distribution import CONDITIONS, draw_view
from lgmd_gym.envs.traffic.emergencies import HARD, Emergencies, drive_on
from lgmd_gym.envs.traffic.registration import KINDS, make_traffic
from lgmd_gym.training.config import Plan
from lgmd_gym.training.offline.episodes import Drive, Moments

PIECE = 10.0  # [s] at most; levels last 7 in the middle, 22 at most
SHORTEST = 1.0  # [s] of a quiet stretch


def record_traffic(
    plan: Plan, split: str, seeds: range, jobs: int, tell: Callable[[int], Any]
) -> list[list[Drive]]:
    """Record one drive through traffic for each seed, and return the quiet pieces of each.

    The kinds of traffic take turns. Light, weather and the ground's grain are drawn as those of levels are.

    Args:
        plan: Of a training.
        split: "train" or "validation"; light and weather are those of its levels.
        seeds: One drive each.
        jobs: Processes.
        tell: Called with 1 when a drive has been added.
    """
    told: Any = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_quiet_pieces)(plan, split, seed) for seed in seeds
    )
    by_seed: list[list[Drive]] = []
    for pieces in told:
        by_seed.append(pieces)
        tell(1)
    return by_seed


def _quiet_pieces(plan: Plan, split: str, seed: int) -> list[Drive]:
    kind = list(KINDS)[seed % len(KINDS)]
    env = make_traffic(kind, camera=plan.camera, include_frame=FRAME in plan.features["inputs"])
    base: Any = env.unwrapped
    base.camera_fields = draw_view(split, seed, CONDITIONS)
    try:
        moments, emergencies = _driven(plan, env, seed)
    finally:
        env.close()
    seen, frames = moments.arrays()
    policy_hz = base.config["policy_frequency"]
    quiet = [emergencies.need(moment / policy_hz) is None for moment in range(len(moments))]
    return [
        quiet_drive(
            {name: array[first:last] for name, array in seen.items()},
            None if frames is None else frames[first:last],
            policy_hz,
        )
        for first, last in cuts(quiet, policy_hz)
    ]


def _driven(plan: Plan, env: gym.Env, seed: int) -> tuple[Moments, Emergencies]:
    """Drive to the end and beyond it as far as an emergency matters."""
    base: Any = env.unwrapped
    moments, hard, done = Moments(plan), [], False
    policy_hz = base.config["policy_frequency"]
    observation, info = env.reset(seed=seed)
    while not done:
        if info["driver_acceleration"] <= -HARD:
            hard.append(len(moments) / policy_hz)
        moments.add(observation)
        observation, _, terminated, truncated, info = env.step(to_action(HOLD))
        done = terminated or truncated
    beyond = drive_on(base, len(moments) / policy_hz)
    return moments, Emergencies(beyond.contact, (*hard, *beyond.hard))


def cuts(quiet: list[bool], policy_hz: float) -> list[tuple[int, int]]:
    """Return first and last (exclusive) decisions of the pieces that quiet stretches are cut into, evenly.

    Args:
        quiet: Of each decision, whether no emergency is near.
        policy_hz: Decisions per second.
    """
    edges = np.flatnonzero(np.diff([0, *map(int, quiet), 0])).reshape(-1, 2)
    pieces = []
    for first, last in edges[edges[:, 1] - edges[:, 0] >= SHORTEST * policy_hz]:
        count = int(np.ceil((last - first) / (PIECE * policy_hz)))
        pieces += pairwise(np.linspace(first, last, count + 1).round().astype(int).tolist())
    return pieces


def quiet_drive(seen: dict[str, np.ndarray], frames: np.ndarray | None, policy_hz: float) -> Drive:
    """Return a drive in which nothing happens, priced as `BrakingEnv` would with its own weights and brake.

    Holding the speed earns progress. Braking from a decision on costs its time to a standstill and earns the
    progress of the way there, as far as the drive's end; what it costs in jerk, a tenth, is left out.

    Args:
        seen: Observations by name, (T, n) each, "ego_speed" among them.
        frames: Camera frames, (T, ...); None if not wanted.
        policy_hz: Decisions per second.
    """
    weights, brake = RewardParams(), BrakeParams()
    speed = seen["ego_speed"][:, 0].astype(float)
    top = max(float(speed.max()), 1e-9)
    left = np.arange(len(speed), 0, -1) / policy_hz  # [s] to the drive's end
    coasting = np.minimum(brake.delay + brake.max_deceleration / brake.jerk / 2.0, left)
    braking = np.minimum(speed / brake.max_deceleration, left - coasting)  # at full deceleration
    way = speed * (coasting + braking) - 0.5 * brake.max_deceleration * braking**2
    return Drive(
        seen,
        frames,
        rewards=(weights.progress * speed / top / policy_hz).astype(np.float32),
        returns=(weights.progress * way / top - weights.brake * braking).astype(np.float32),
        contacts=np.zeros(len(speed), bool),
        threat=False,
    )
