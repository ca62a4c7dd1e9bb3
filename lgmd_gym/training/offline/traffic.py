"""Segments of episodes in traffic, without a threat and, with drivers who err, before a contact.

Levels last seconds and contain little driving without an event: following, oncoming cars, starting. Traffic
episodes add it. Segments far from any emergency are kept; braking in them is always a false activation, so
its return is computed without replays.

With inattentive drivers, the last seconds before a contact that braking avoids are kept, too. The return of
braking at their decisions comes from replays of the traffic without sensors.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import BRAKE, make_agent, to_action
from lgmd_gym.benchmark.episode import rollout
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.benchmark.traffic.branch import fork
from lgmd_gym.camera.scene import WEATHERS
from lgmd_gym.envs.attention import INATTENTIVE
from lgmd_gym.envs.dynamics.brake import EMERGENCY, BrakeParams
from lgmd_gym.envs.families.distribution import draw_weather
from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.envs.traffic.emergencies import Emergencies, simulate_driver
from lgmd_gym.envs.traffic.env import JAM_SPEED, TrafficEnv
from lgmd_gym.neuron import NeuronSpec
from lgmd_gym.sensing.channel import ChannelSpec
from lgmd_gym.training.offline.episodes import (
    TRAFFIC,
    BrakingOutcome,
    Observation,
    RecordedEpisode,
    select_signals,
    stack,
)
from lgmd_gym.training.offline.recorder import STRIDE, braking_outcomes

MARGIN = 10.0  # segments end this time before an emergency [s]
MAX_LENGTH = 10.0  # longest segment [s]; levels last 7 s in the median and 22 s at most
MIN_LENGTH = 1.0  # shortest stretch without an emergency that is kept [s]


@dataclass(frozen=True)
class TrafficRecorder:
    """Records segments of traffic episodes far from any emergency; the seed selects the kind of traffic."""

    split: str  # "train" or "validation"; light, weather and ground texture are drawn as for its levels
    camera: ChannelSpec  # see `LGMDObservation`
    # kinds of traffic, for successive seeds in turn; those with `INATTENTIVE` before them have such drivers
    kinds: tuple[str, ...] = tuple(TRAFFIC_KINDS)
    shrink: int | None = None  # see `select_signals`
    params: NeuronSpec = None  # parameters of the neurons, see `LGMDObservation`

    def record(self, seeds: range) -> list[list[RecordedEpisode]]:
        """Return the segments of one traffic episode for each seed."""
        return [self._record_segments(seed) for seed in seeds]

    def _record_segments(self, seed: int) -> list[RecordedEpisode]:
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
        env = make(camera=self.camera, params=self.params, include_frame=self.shrink is not None)
        base: Any = env.unwrapped
        try:
            observations, emergencies = run_episode(env, seed, self.shrink)
        finally:
            env.close()
        policy_hz = base.config["policy_frequency"]
        times = np.arange(len(observations)) / policy_hz
        non_threat = [emergencies.time_until(time, MARGIN) is None for time in times.tolist()]
        segments = [
            non_threat_episode(stack(observations[first:last]), policy_hz)
            for first, last in segment_bounds(non_threat, policy_hz)
        ]
        # a later contact is beyond the episode's end
        if erring and observations and emergencies.contact == len(observations) / policy_hz:
            threat = threat_episode(make(camera=None), seed, observations)
            segments += [] if threat is None else [threat]
        return segments


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


def threat_episode(twin: gym.Env, seed: int, observations: list[Observation]) -> RecordedEpisode | None:
    """Return the segment before the contact that ends an episode, with the outcome of braking.

    Rewards are those of `BrakingEnv` without jerk, with the highest speed of the segment as scripted speed.
    The outcome of braking ends at a standstill or a contact, also one that another car causes.

    Args:
        twin: The same environment without sensors.
        seed: Seed of the episode.
        observations: Observations of all its decisions.

    Returns:
        The segment; None for a contact of an ego that stands, or one that no braking in the segment avoids.
    """
    env: Any = twin.unwrapped
    policy_hz, last = env.config["policy_frequency"], len(observations)
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
    segment = stack(observations[first:last])
    speed = segment["ego_speed"][:, 0].astype(float)
    top_speed = max(float(speed.max()), 1e-9)

    def replay(pairs: list[tuple[int, int]]) -> Iterator[BrakingOutcome]:
        for _, onset in pairs:
            copy = fork(snapshots[onset // STRIDE])
            for _ in range(onset % STRIDE):
                copy.step_unobserved()
            yield brake_to_standstill(copy, top_speed)

    if contact.impact_speed < JAM_SPEED:
        return None
    (outcomes,) = braking_outcomes([len(speed)], replay)
    if all(outcome.contact for outcome in outcomes):
        return None
    weights = RewardParams()
    rewards = weights.progress * speed / top_speed / policy_hz
    rewards[-1] -= _contact_cost(contact.relative_impact_speed, top_speed)
    return RecordedEpisode(
        segment,
        rewards=rewards.astype(np.float32),
        braking_returns=np.array([outcome.episode_return for outcome in outcomes], np.float32),
        braking_contacts=np.array([outcome.contact for outcome in outcomes]),
        threat=True,
        traffic=True,
        family=TRAFFIC,
    )


def brake_to_standstill(env: Any, top_speed: float) -> BrakingOutcome:
    """Brake fully up to a standstill or a contact, and return the outcome with the rewards of `BrakingEnv`.

    Args:
        env: The environment; it is stepped.
        top_speed: Scripted speed of the rewards [m/s].
    """
    weights, dt = RewardParams(), 1.0 / float(env.config["policy_frequency"])
    env.action_type.act(to_action(BRAKE))
    total, speed = 0.0, float(env.ego.speed)
    while True:
        info, _ = env.advance()
        before, speed = speed, float(info["ego_speed"])
        total += weights.progress * dt * min((before + speed) / (2.0 * top_speed), 1.0)
        if info["collision"]:
            total -= _contact_cost(float(info["relative_impact_speed"]), top_speed)
            return BrakingOutcome(total, True)
        if info["ttc"] >= weights.need_ttc:
            total -= weights.brake * dt * float(info["deceleration"]) / env.brake.max_deceleration
        if speed == 0.0:
            return BrakingOutcome(total, False)


def _contact_cost(relative_impact_speed: float, top_speed: float) -> float:
    """Return the cost of a contact with a relative impact speed [m/s]; `BrakingEnv` has the formula."""
    weights = RewardParams()
    return weights.contact + weights.impact * min(max(relative_impact_speed, 0.0) / top_speed, 1.0) ** 2
