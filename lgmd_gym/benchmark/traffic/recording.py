"""Recordings of traffic without an agent, which can be forked at any decision."""

import copy
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import HOLD, make_agent, to_action
from lgmd_gym.benchmark.episode import Step, rollout
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.envs.traffic.emergencies import HARD_BRAKING, HORIZON, Emergencies, simulate_driver
from lgmd_gym.envs.traffic.registration import traffic_id

SNAPSHOT_EVERY = 300  # decisions between two snapshots; one snapshot takes as long as about 20 decisions


@dataclass(frozen=True, slots=True)
class TrafficRecording:
    """One episode of traffic without an agent.

    Attributes:
        kind: Kind of traffic.
        seed: Seed of the traffic.
        steps: Step of every decision.
        snapshots: Environment at every `SNAPSHOT_EVERY`-th decision; copied before use, never stepped.
        emergencies: Emergencies up to `HORIZON` beyond the end.
        policy_hz: Decision rate [Hz].
        fps: Camera frame rate [Hz].
    """

    kind: str
    seed: int
    steps: tuple[Step, ...]
    snapshots: tuple[gym.Env, ...]
    emergencies: Emergencies
    policy_hz: float
    fps: float

    def fork(self, decision: int) -> gym.Env:
        """Return an environment in the exact state of a decision.

        Raises:
            RuntimeError: If its observation differs from the recorded one.
        """
        env = fork(self.snapshots[decision // SNAPSHOT_EVERY])
        recorded = observation = self.steps[decision].observation
        for _ in range(decision % SNAPSHOT_EVERY):
            observation = env.step(to_action(HOLD))[0]
        if not all(np.array_equal(observation[key], recorded[key]) for key in recorded):
            raise RuntimeError(
                f"{self.kind} traffic, seed {self.seed} does not repeat at decision {decision}"
            )
        return env


def record_traffic(
    kind: str, seed: int, sensor_config: SensorConfig, config: dict[str, Any] | None = None
) -> TrafficRecording:
    """Record one episode of traffic without an agent.

    Args:
        kind: Kind of traffic, a name in `lgmd_gym.envs.traffic.registration.KINDS`.
        seed: Seed of the traffic.
        sensor_config: Camera and neuron parameters.
        config: Configuration of `TrafficEnv`.
    """
    env = gym.make(traffic_id(kind), **sensor_config.for_agent().arguments, trace=True, config=config)
    base: Any = env.unwrapped
    policy_hz = base.config["policy_frequency"]
    steps: list[Step] = []
    snapshots: list[gym.Env] = []
    for step, _ in rollout(env, make_agent(NO_BRAKE), seed):
        if len(steps) % SNAPSHOT_EVERY == 0 and not step.done:
            snapshots.append(fork(env))
        steps.append(step)
    driver = [step.info["driver_acceleration"] for step in steps]
    hard = [index / policy_hz for index, value in enumerate(driver) if value <= -HARD_BRAKING]
    beyond = look_ahead(env, (len(steps) - 1) / policy_hz)
    emergencies = Emergencies(beyond.contact, (*hard, *beyond.hard))
    fps = env.get_wrapper_attr("fps")
    return TrafficRecording(kind, seed, tuple(steps), tuple(snapshots), emergencies, policy_hz, fps)


def fork(env: gym.Env, share_cameras: bool = False) -> gym.Env:
    """Return an independent copy of a traffic environment inside `LGMDObservation`, in the same state.

    The lanes are shared because they never change. Cameras are copied with their state, except those that
    hold resources (the bird's-eye view).

    Args:
        env: Environment to copy.
        share_cameras: Share all cameras, for a copy that renders no frames.
    """
    base: Any = env.unwrapped
    network = base.road.network
    shared = [network, *network.lanes_list()]
    for cameras in env.get_wrapper_attr("sensors").cameras:
        shared += [camera for camera in cameras.values() if share_cameras or hasattr(camera, "close")]
    return copy.deepcopy(env, {id(item): item for item in shared})


def look_ahead(env: gym.Env, time: float, horizon: float = HORIZON) -> Emergencies:
    """Return the emergencies without braking by the agent, leaving `env` unchanged.

    Args:
        env: Traffic environment inside `LGMDObservation`.
        time: Present time [s].
        horizon: Time ahead [s].
    """
    base: Any = fork(env, share_cameras=True).unwrapped
    return simulate_driver(base, time, horizon)
