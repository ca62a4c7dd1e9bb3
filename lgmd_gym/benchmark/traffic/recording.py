"""Recordings of traffic without an agent, which can be forked at any decision."""

import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from lgmd_gym.aliases import Config
from lgmd_gym.benchmark.traffic.reader import Moment, SceneReader
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.registration import make_traffic
from lgmd_gym.envs.traffic.emergencies import EMERGENCY, HORIZON, Emergencies, simulate_driver
from lgmd_gym.envs.traffic.env import JAM_SPEED, TrafficEnv
from lgmd_gym.sensing.sensor_array import SensorArray

SNAPSHOT_EVERY = 300  # decisions between two snapshots; one snapshot takes as long as about 10 decisions


@dataclass(frozen=True)
class TrafficRecording:
    """One episode of traffic without an agent. Its frames are not drawn; see `Observer`."""

    kind: str  # kind of traffic
    seed: int  # seed of the traffic
    moments: tuple[Moment, ...]  # the reset and every decision
    # environment at every `SNAPSHOT_EVERY`-th decision; copied before use, never stepped
    snapshots: tuple[TrafficEnv, ...]
    policy_hz: float  # decision rate [Hz]
    fps: float  # camera frame rate [Hz]

    @cached_property
    def emergencies(self) -> Emergencies:
        """Emergencies up to `HORIZON` beyond the end."""
        required = [moment.info["required_deceleration"] for moment in self.moments]
        demanding = [index / self.policy_hz for index, value in enumerate(required) if value >= EMERGENCY]
        end = len(self.moments) - 1
        beyond = simulate_driver(self.fork(end), end / self.policy_hz)
        return Emergencies(beyond.contact, tuple(sorted({*demanding, *beyond.demanding})))

    @cached_property
    def moving_and_needed(self) -> tuple[float, float]:
        """Time in motion, above 0.5 m/s, and the part of it in which a brake is needed [s]."""
        moving = [
            index / self.policy_hz for index, moment in enumerate(self.moments) if moment.speed > JAM_SPEED
        ]
        needed = sum(self.emergencies.time_until(time) is not None for time in moving)
        return len(moving) / self.policy_hz, needed / self.policy_hz

    def fork(self, decision: int) -> TrafficEnv:
        """Return an environment in the exact state of a decision.

        Raises:
            RuntimeError: If its state differs from the recorded one.
        """
        number = min(decision // SNAPSHOT_EVERY, len(self.snapshots) - 1)
        env = fork(self.snapshots[number])
        for _ in range(decision - number * SNAPSHOT_EVERY):
            env.step_unobserved()
        recorded = self.moments[decision].info
        if (env.ego.speed, env.ego.travelled) != (recorded["ego_speed"], recorded["distance"]):
            raise RuntimeError(
                f"{self.kind} traffic, seed {self.seed} does not repeat at decision {decision}"
            )
        return env


def record_traffic(
    kind: str,
    seed: int,
    sensors: SensorArray,
    index: int,
    fps: float,
    appearance: Appearance,
    config: Config | None = None,
) -> TrafficRecording:
    """Record one episode of traffic without an agent.

    Args:
        kind: Kind of traffic, a name in `lgmd_gym.envs.registration.TRAFFIC_KINDS`.
        seed: Seed of the traffic.
        sensors: Cameras that will draw the frames.
        index: Index of the episode among the environments of the cameras.
        fps: Camera frame rate [Hz].
        appearance: World, condition and road.
        config: Configuration of `TrafficEnv`.
    """
    env: Any = make_traffic(kind, camera=None, config=config)
    env.appearance = appearance
    reader = SceneReader(env, sensors, index, fps)
    moments, snapshots = [reader.reset(seed)], [fork(env)]
    while not moments[-1].done:
        moments.append(reader.step())
        if (len(moments) - 1) % SNAPSHOT_EVERY == 0:
            snapshots.append(fork(env))
    return TrafficRecording(kind, seed, tuple(moments), tuple(snapshots), env.config["policy_frequency"], fps)


def fork(env: TrafficEnv) -> TrafficEnv:
    """Return an independent copy of a traffic environment in the same state.

    The lanes are shared because they never change. The copy's road has no callback of `on_road_step`.
    """
    network = env.road.network
    callback = vars(env.road).pop("step", None)
    try:
        return copy.deepcopy(env, {id(item): item for item in (network, *network.lanes_list())})
    finally:
        if callback is not None:
            vars(env.road)["step"] = callback


def look_ahead(env: TrafficEnv, time: float, horizon: float = HORIZON) -> Emergencies:
    """Return the emergencies without braking by the agent, leaving `env` unchanged.

    Args:
        env: Traffic environment.
        time: Present time [s].
        horizon: Time ahead [s].
    """
    return simulate_driver(fork(env), time, horizon)
