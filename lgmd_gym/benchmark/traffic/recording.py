"""One drive through traffic without an agent, kept so that any agent can look at it and leave it anywhere."""

import copy
from dataclasses import dataclass
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np

from lgmd_gym.agents import HOLD, to_action
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.envs.traffic.emergencies import HARD, HORIZON, Emergencies, drive_on
from lgmd_gym.envs.traffic.registration import make_traffic

EVERY = 300  # decisions between two kept states: copying one takes as long as some 20 decisions


class Seen(NamedTuple):
    """What an agent is shown at one decision."""

    observation: dict[str, Any]
    info: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Trace:
    """A recorded drive.

    Attributes:
        kind: Of the traffic.
        seed: Of the traffic.
        seen: What is to be seen at every decision; the last one has no next.
        kept: States at every `EVERY`-th decision, never to be stepped themselves.
        emergencies: Of the drive and `HORIZON` beyond its end.
        policy_hz: Decisions per second.
        fps: Camera frames per second.
    """

    kind: str
    seed: int
    seen: tuple[Seen, ...]
    kept: tuple[gym.Env, ...]
    emergencies: Emergencies
    policy_hz: float
    fps: float

    def fork(self, decision: int) -> gym.Env:
        """Return an environment in the state of a decision, bit for bit, to go on with.

        Raises:
            RuntimeError: If what is seen there is not what was recorded; nothing could be compared then.
        """
        env = fork(self.kept[decision // EVERY])
        recorded = observation = self.seen[decision].observation
        for _ in range(decision % EVERY):
            observation = env.step(to_action(HOLD))[0]
        if not all(np.array_equal(observation[key], recorded[key]) for key in recorded):
            raise RuntimeError(
                f"{self.kind} traffic, seed {self.seed} does not repeat at decision {decision}"
            )
        return env


def record(kind: str, seed: int, sensor_config: SensorConfig, config: dict[str, Any] | None = None) -> Trace:
    """Drive once without an agent and keep what is needed.

    Args:
        kind: A name in `lgmd_gym.envs.traffic.registration.KINDS`.
        seed: Of the traffic.
        sensor_config: Camera and neuron parameters.
        config: Configuration of `TrafficEnv`.
    """
    env = make_traffic(kind, **sensor_config.of().arguments, trace=True, config=config)
    base: Any = env.unwrapped
    policy_hz = base.config["policy_frequency"]
    seen, kept = [Seen(*env.reset(seed=seed))], []
    while True:
        if (len(seen) - 1) % EVERY == 0:
            kept.append(fork(env))
        observation, _, terminated, truncated, info = env.step(to_action(HOLD))
        seen.append(Seen(observation, info))
        if terminated or truncated:
            break
    hard = [k / policy_hz for k, item in enumerate(seen) if item.info["driver_acceleration"] <= -HARD]
    beyond = look_ahead(env, (len(seen) - 1) / policy_hz)
    emergencies = Emergencies(beyond.contact, (*hard, *beyond.hard))
    return Trace(kind, seed, tuple(seen), tuple(kept), emergencies, policy_hz, env.get_wrapper_attr("fps"))


def fork(env: gym.Env, blind: bool = False) -> gym.Env:
    """Return a copy of traffic inside `LGMDObservation`, in the same state, that goes its own way.

    The lanes are shared, they never change. Cameras are copied with what their last frame has left in them,
    but for those that hold resources (the view from above).

    Args:
        env: What to copy.
        blind: Share the cameras, for a branch that nobody looks at.
    """
    base: Any = env.unwrapped
    network = base.road.network
    shared = [network, *network.lanes_list()]
    for cameras in env.get_wrapper_attr("sensors").sets:
        shared += [camera for camera in cameras.values() if blind or hasattr(camera, "close")]
    return copy.deepcopy(env, {id(item): item for item in shared})


def look_ahead(env: gym.Env, time: float, horizon: float = HORIZON) -> Emergencies:
    """Return the emergencies that come if nobody brakes but the driver; `env` stays as it is.

    Args:
        env: Traffic inside `LGMDObservation`.
        time: At present [s].
        horizon: How far to look [s].
    """
    base: Any = fork(env, blind=True).unwrapped
    return drive_on(base, time, horizon)
