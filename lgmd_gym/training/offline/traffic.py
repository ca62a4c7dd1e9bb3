"""Episodes without a threat, recorded in traffic.

Levels last seconds and contain little driving without an event: following, oncoming cars, starting. Traffic
episodes add it. Segments far from any emergency are kept; braking in them is always a false activation, so
its return is computed without replays.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import rollout
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.camera.scene import WEATHERS
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.families.distribution import draw_weather
from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.envs.traffic.emergencies import EMERGENCY, Emergencies, simulate_driver
from lgmd_gym.neuron import NeuronSpec
from lgmd_gym.sensing.channel import ChannelSpec
from lgmd_gym.training.offline.episodes import TRAFFIC, Observation, RecordedEpisode, select_signals, stack

MARGIN = 10.0  # segments end this time before an emergency [s]
MAX_LENGTH = 10.0  # longest segment [s]; levels last 7 s in the median and 22 s at most
MIN_LENGTH = 1.0  # shortest stretch without an emergency that is kept [s]


@dataclass(frozen=True)
class TrafficRecorder:
    """Records segments of traffic episodes far from any emergency; the seed selects the kind of traffic."""

    split: str  # "train" or "validation"; light, weather and ground texture are drawn as for its levels
    camera: ChannelSpec  # see `LGMDObservation`
    kinds: tuple[str, ...] = tuple(TRAFFIC_KINDS)  # kinds of traffic, for successive seeds in turn
    shrink: int | None = None  # see `select_signals`
    params: NeuronSpec = None  # parameters of the neurons, see `LGMDObservation`

    def record(self, seeds: range) -> list[list[RecordedEpisode]]:
        """Return the segments of one traffic episode for each seed."""
        return [self._record_segments(seed) for seed in seeds]

    def _record_segments(self, seed: int) -> list[RecordedEpisode]:
        kind = self.kinds[seed % len(self.kinds)]
        with_frame = self.shrink is not None
        weather, texture = draw_weather(self.split, seed, tuple(WEATHERS))
        env = make_traffic(
            kind,
            self.camera,
            params=self.params,
            include_frame=with_frame,
            weather=weather,
            scene={"texture": texture},
            split=self.split,
        )
        base: Any = env.unwrapped
        try:
            observations, emergencies = run_episode(env, seed, self.shrink)
        finally:
            env.close()
        policy_hz = base.config["policy_frequency"]
        times = np.arange(len(observations)) / policy_hz
        non_threat = [emergencies.time_until(time, MARGIN) is None for time in times.tolist()]
        return [
            non_threat_episode(stack(observations[first:last]), policy_hz)
            for first, last in segment_bounds(non_threat, policy_hz)
        ]


def run_episode(env: gym.Env, seed: int, shrink: int | None = None) -> tuple[list[Observation], Emergencies]:
    """Run a traffic episode without braking and return its observations and emergencies.

    Args:
        env: Traffic environment; it is advanced beyond the episode's end to find later emergencies.
        seed: Seed of the reset.
        shrink: See `select_signals`.
    """
    base: Any = env.unwrapped
    observations: list[Observation] = []
    demanding: list[float] = []
    policy_hz = base.config["policy_frequency"]
    for step, _ in rollout(env, make_agent(NO_BRAKE), seed):
        if step.done:
            break
        if step.info["required_deceleration"] >= EMERGENCY:
            demanding.append(len(observations) / policy_hz)
        observations.append(select_signals(step.observation, shrink))
    later = simulate_driver(base, len(observations) / policy_hz, MARGIN)
    return observations, Emergencies(later.contact, (*demanding, *later.demanding))


def segment_bounds(non_threat: list[bool], policy_hz: float) -> list[tuple[int, int]]:
    """Return first and last (exclusive) decision of each segment; a long stretch is divided evenly.

    Args:
        non_threat: Whether no emergency follows within `MARGIN`, for each decision.
        policy_hz: Decision rate [Hz].
    """
    edges = np.flatnonzero(np.diff([0, *map(int, non_threat), 0])).reshape(-1, 2)
    bounds: list[tuple[int, int]] = []
    for first, last in edges[edges[:, 1] - edges[:, 0] >= MIN_LENGTH * policy_hz]:
        count = int(np.ceil((last - first) / (MAX_LENGTH * policy_hz)))
        ends = np.linspace(float(first), float(last), count + 1)
        bounds += pairwise(ends.round().astype(int).tolist())
    return bounds


def non_threat_episode(observations: Observation, policy_hz: float) -> RecordedEpisode:
    """Return an episode without a threat, with the rewards of `BrakingEnv` for its default weights and brake.

    Holding the speed earns progress. Braking costs its time to a standstill, or to the end of the episode,
    and earns the progress on the way. The cost of jerk, 0.1 in total, is neglected.

    Args:
        observations: Observations by name, (T, ...) each; "ego_speed" is required.
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
        rewards=(weights.progress * speed / top_speed / policy_hz).astype(np.float32),
        braking_returns=braking_returns.astype(np.float32),
        braking_contacts=np.zeros(len(speed), bool),
        threat=False,
        traffic=True,
        family=TRAFFIC,
    )
