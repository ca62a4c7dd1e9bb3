"""Segments of episodes in traffic, without a threat and, with drivers who err, before a contact.

Levels last seconds and contain little driving without an event: following, oncoming cars, starting. Traffic
episodes add it. Segments are kept in which the benchmark would call a brake needless: no emergency follows
within `HORIZON`, see `lgmd_gym.envs.traffic.emergencies`. There, the time to brake is infinite.

With inattentive drivers, the last 10 s before a contact that braking avoids are kept with their time to
brake, and left out before any other contact. The last decision from which braking avoids it comes from
replays of the traffic without sensors. The agent never brakes in these episodes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from math import inf
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import BRAKE, make_agent, to_action
from lgmd_gym.agents.base import FPS
from lgmd_gym.benchmark.episode import rollout
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.benchmark.traffic.branch import fork
from lgmd_gym.camera.scene import WEATHERS
from lgmd_gym.envs.attention import INATTENTIVE
from lgmd_gym.envs.families.distribution import draw_weather
from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.traffic.emergencies import Emergencies, scaled_emergency, simulate_driver
from lgmd_gym.envs.traffic.env import JAM_SPEED, TrafficEnv
from lgmd_gym.neuron import NeuronSpec
from lgmd_gym.sensing.channel import ChannelSpec
from lgmd_gym.training.offline.episodes import (
    TRAFFIC,
    DrivenEpisode,
    Observation,
    select_signals,
    stack,
)

MAX_LENGTH = 10.0  # longest segment [s]; levels last 7 s in the median and 22 s at most
MIN_LENGTH = 1.0  # shortest stretch without an emergency that is kept [s]
STRIDE = 6  # largest distance of two replays [decisions], 0.2 s at 30 Hz


@dataclass(frozen=True)
class TrafficRecorder:
    """Records segments of traffic episodes; the seed selects the kind of traffic."""

    split: str  # "train" or "validation"; light, weather and ground texture are drawn as for its levels
    camera: ChannelSpec  # see `LGMDObservation`
    # kinds of traffic, for successive seeds in turn; those with `INATTENTIVE` before them have such drivers
    kinds: tuple[str, ...] = tuple(TRAFFIC_KINDS)
    params: NeuronSpec = None  # parameters of the neurons, see `LGMDObservation`

    def record(self, seeds: range) -> list[list[DrivenEpisode]]:
        """Return the segments of one traffic episode for each seed."""
        return [self._record_segments(seed) for seed in seeds]

    def _record_segments(self, seed: int) -> list[DrivenEpisode]:
        kind = self.kinds[seed % len(self.kinds)]
        erring = kind.startswith(INATTENTIVE)
        weather, texture = draw_weather(self.split, seed, tuple(WEATHERS))
        make = partial(
            make_traffic,
            kind.removeprefix(INATTENTIVE),
            weather=weather,
            scene={"texture": texture},
            split=self.split,
            **({"attention": "inattentive"} if erring else {}),
        )
        env = make(camera=self.camera, params=self.params, include_frame=False)
        base: Any = env.unwrapped
        try:
            observations, emergencies = run_episode(env, seed)
        finally:
            env.close()
        policy_hz = base.config["policy_frequency"]
        times = np.arange(len(observations)) / policy_hz
        non_threat = [emergencies.time_until(time) is None for time in times.tolist()]
        # a later contact is beyond the episode's end
        crashes = erring and bool(observations) and emergencies.contact == len(observations) / policy_hz
        if crashes:  # the last decisions are those of `threat_episode`
            non_threat[-round(MAX_LENGTH * policy_hz) :] = []
        segments = [
            _segment(observations[first:last], np.full(last - first, inf))
            for first, last in segment_bounds(non_threat, policy_hz)
        ]
        if crashes:
            threat = threat_episode(make(camera=None), seed, observations)
            segments += [] if threat is None else [threat]
        return segments


def run_episode(env: gym.Env, seed: int) -> tuple[list[Observation], Emergencies]:
    """Run a traffic episode without braking and return its observations and emergencies.

    The emergencies are scaled to the brake of the episode, as for needless activations in the benchmark.

    Args:
        env: Traffic environment; it is advanced beyond the episode's end to find later emergencies.
        seed: Seed of the reset.
    """
    base: Any = env.unwrapped
    observations: list[Observation] = []
    demanding: list[float] = []
    policy_hz = base.config["policy_frequency"]
    for step, _ in rollout(env, make_agent(NO_BRAKE), seed):
        if step.done:
            break
        if step.info["required_deceleration"] >= scaled_emergency(base.brake):
            demanding.append(len(observations) / policy_hz)
        observations.append(select_signals(step.observation))
    later = simulate_driver(base, len(observations) / policy_hz, threshold=scaled_emergency(base.brake))
    return observations, Emergencies(later.contact, (*demanding, *later.demanding))


def segment_bounds(non_threat: list[bool], policy_hz: float) -> list[tuple[int, int]]:
    """Return first and last (exclusive) decision of each segment; a long stretch is divided evenly.

    Args:
        non_threat: Whether no emergency follows within `HORIZON`, for each decision.
        policy_hz: Decision rate [Hz].
    """
    edges = np.flatnonzero(np.diff([0, *map(int, non_threat), 0])).reshape(-1, 2)
    bounds: list[tuple[int, int]] = []
    for first, last in edges[edges[:, 1] - edges[:, 0] >= MIN_LENGTH * policy_hz]:
        count = int(np.ceil((last - first) / (MAX_LENGTH * policy_hz)))
        ends = np.linspace(float(first), float(last), count + 1)
        bounds += pairwise(ends.round().astype(int).tolist())
    return bounds


def threat_episode(twin: gym.Env, seed: int, observations: list[Observation]) -> DrivenEpisode | None:
    """Return the segment before the contact that ends an episode, with its time to brake.

    Args:
        twin: The same environment without sensors.
        seed: Seed of the episode.
        observations: Observations of all its decisions.

    Returns:
        The segment; None for a contact of an ego that stands, or one that no braking in the segment avoids.
    """
    env: Any = twin.unwrapped
    policy_hz, last = float(env.config["policy_frequency"]), len(observations)
    first = max(last - round(MAX_LENGTH * policy_hz), 0)
    twin.reset(seed=seed)
    snapshots: list[TrafficEnv] = []
    for decision in range(last):
        if decision >= first and (decision - first) % STRIDE == 0:
            snapshots.append(fork(env))
        env.step_unobserved()
    contact = env.road.contact
    if contact is None:
        raise RuntimeError(f"traffic of seed {seed} does not repeat its contact at decision {last}")

    def avoids(onset: int) -> bool:
        copy = fork(snapshots[onset // STRIDE])
        for _ in range(onset % STRIDE):
            copy.step_unobserved()
        return brake_to_standstill(copy)

    timely = None if contact.impact_speed < JAM_SPEED else last_timely(last - first, avoids)
    if timely is None:
        return None
    return _segment(observations[first:], np.maximum(timely - np.arange(last - first), 0) / FPS)


def last_timely(count: int, avoids: Callable[[int], bool]) -> int | None:
    """Return the last decision from which braking avoids a contact; None if there is none.

    Every sixth decision is replayed, backwards from the contact, and the interval behind the first one that
    avoids it is bisected. A change in between that lasts less than six decisions is not noticed.

    Args:
        count: Number of decisions, >= 1.
        avoids: Returns whether braking from a decision on avoids the contact.
    """
    grid = [*range(0, count - 1, STRIDE), count - 1]
    late = count
    for early in reversed(grid):
        if avoids(early):
            while late - early > 1:
                middle = (early + late) // 2
                early, late = (middle, late) if avoids(middle) else (early, middle)
            return early
        late = early
    return None


def brake_to_standstill(env: Any) -> bool:
    """Brake fully up to a standstill or a contact, and return whether there is no contact.

    A contact that another car causes counts as well.

    Args:
        env: The environment; it is stepped.
    """
    env.action_type.act(to_action(BRAKE))
    while True:
        info, _ = env.advance()
        if info["collision"]:
            return False
        if float(info["ego_speed"]) == 0.0:
            return True


def _segment(observations: list[Observation], times: np.ndarray) -> DrivenEpisode:
    """Return an episode without braking by the agent, with its times to brake [s]."""
    return DrivenEpisode(
        stack(observations),
        times.astype(np.float32),
        np.zeros(len(times), np.float32),
        threat=bool(np.isfinite(times).any()),
        family=TRAFFIC,
    )
