"""Episodes without a threat, recorded in traffic.

Levels last seconds and contain little driving without an event: following, oncoming cars, starting. Traffic
episodes add it. Segments far from any emergency are kept; braking in them is always a false activation, so
its return is computed without replays.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents.base import HOLD, to_action
from lgmd_gym.camera import CameraSpec
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.envs.scenarios.distribution import CONDITIONS, draw_view
from lgmd_gym.envs.traffic.emergencies import HARD, Emergencies, drive_on
from lgmd_gym.envs.traffic.registration import KINDS, make_traffic
from lgmd_gym.training.offline.episodes import ObservationBuffer, RecordedEpisode, record_chunks

MAX_LENGTH = 10.0  # longest segment [s]; levels last 7 s in the median and 22 s at most
MIN_LENGTH = 1.0  # shortest stretch without an emergency that is kept [s]


@dataclass(frozen=True)
class TrafficRecorder:
    """Records segments of traffic episodes far from any emergency; the seed selects the kind of traffic.

    Attributes:
        split: "train" or "validation"; light, weather and ground texture are drawn as for its levels.
        camera: See `LGMDObservation`.
        shrink: See `ObservationBuffer`.
    """

    split: str
    camera: CameraSpec
    shrink: int | None = None

    def record(
        self, seeds: range, jobs: int = 1, on_recorded: Callable[[int], Any] = lambda count: None
    ) -> list[list[RecordedEpisode]]:
        """Record one traffic episode per seed and return the segments of each.

        Args:
            seeds: Seeds of the environment.
            jobs: Number of processes.
            on_recorded: Called with the number of traffic episodes added.
        """
        chunks = (range(seed, seed + 1) for seed in seeds)
        return record_chunks(self._record_chunk, chunks, jobs, on_recorded)

    def _record_chunk(self, seeds: range) -> list[list[RecordedEpisode]]:
        return [self._record_segments(seed) for seed in seeds]

    def _record_segments(self, seed: int) -> list[RecordedEpisode]:
        kind = list(KINDS)[seed % len(KINDS)]
        env = make_traffic(kind, camera=self.camera, include_frame=self.shrink is not None)
        base: Any = env.unwrapped
        base.camera_fields = draw_view(self.split, seed, CONDITIONS)
        buffer = ObservationBuffer(self.shrink)
        try:
            emergencies = run_episode(env, seed, buffer)
        finally:
            env.close()
        observations, frames = buffer.arrays()
        policy_hz = base.config["policy_frequency"]
        non_threat = [emergencies.need(decision / policy_hz) is None for decision in range(len(buffer))]
        return [
            non_threat_episode(
                {name: array[first:last] for name, array in observations.items()},
                None if frames is None else frames[first:last],
                policy_hz,
            )
            for first, last in segment_bounds(non_threat, policy_hz)
        ]


def run_episode(env: gym.Env, seed: int, buffer: ObservationBuffer) -> Emergencies:
    """Run a traffic episode without braking, fill the buffer and return the emergencies.

    Args:
        env: Traffic environment; it is advanced beyond the episode's end to find later emergencies.
        seed: Seed of the reset.
        buffer: Buffer that receives every observation at which an action is chosen.
    """
    base: Any = env.unwrapped
    hard_brakings, done = [], False
    policy_hz = base.config["policy_frequency"]
    observation, info = env.reset(seed=seed)
    while not done:
        if info["driver_acceleration"] <= -HARD:
            hard_brakings.append(len(buffer) / policy_hz)
        buffer.add(observation)
        observation, _, terminated, truncated, info = env.step(to_action(HOLD))
        done = terminated or truncated
    later = drive_on(base, len(buffer) / policy_hz)
    return Emergencies(later.contact, (*hard_brakings, *later.hard))


def segment_bounds(non_threat: list[bool], policy_hz: float) -> list[tuple[int, int]]:
    """Return first and last (exclusive) decision of each segment; a long stretch is divided evenly.

    Args:
        non_threat: Whether no emergency is near, for each decision.
        policy_hz: Decision rate [Hz].
    """
    edges = np.flatnonzero(np.diff([0, *map(int, non_threat), 0])).reshape(-1, 2)
    bounds = []
    for first, last in edges[edges[:, 1] - edges[:, 0] >= MIN_LENGTH * policy_hz]:
        count = int(np.ceil((last - first) / (MAX_LENGTH * policy_hz)))
        bounds += pairwise(np.linspace(first, last, count + 1).round().astype(int).tolist())
    return bounds


def non_threat_episode(
    observations: dict[str, np.ndarray], frames: np.ndarray | None, policy_hz: float
) -> RecordedEpisode:
    """Return an episode without a threat, with the rewards of `BrakingEnv` for its default weights and brake.

    Holding the speed earns progress. Braking costs its time to a standstill, or to the end of the episode,
    and earns the progress on the way. The cost of jerk, 0.1 in total, is neglected.

    Args:
        observations: Observations by name, (T, n) each; "ego_speed" is required.
        frames: Camera frames, (T, ...); None without frames.
        policy_hz: Decision rate [Hz].
    """
    weights, brake = RewardParams(), BrakeParams()
    speed = observations["ego_speed"][:, 0].astype(float)
    top_speed = max(float(speed.max()), 1e-9)
    remaining = np.arange(len(speed), 0, -1) / policy_hz  # [s]
    coasting = np.minimum(brake.delay + brake.max_deceleration / brake.jerk / 2.0, remaining)
    braking = np.minimum(speed / brake.max_deceleration, remaining - coasting)  # at full deceleration
    distance = speed * (coasting + braking) - 0.5 * brake.max_deceleration * braking**2
    braking_returns = weights.progress * distance / top_speed - weights.brake * braking
    return RecordedEpisode(
        observations,
        frames,
        rewards=(weights.progress * speed / top_speed / policy_hz).astype(np.float32),
        braking_returns=braking_returns.astype(np.float32),
        braking_contacts=np.zeros(len(speed), bool),
        threat=False,
        traffic=True,
    )
