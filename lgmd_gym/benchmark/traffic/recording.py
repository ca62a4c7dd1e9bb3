"""Recordings of traffic without an agent, which can be forked at any decision."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from lgmd_gym.aliases import Config
from lgmd_gym.benchmark.metrics import PREMATURE
from lgmd_gym.benchmark.traffic.branch import Branch, avoids, fork
from lgmd_gym.benchmark.traffic.reader import Moment, SceneReader
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.attention import Attention
from lgmd_gym.envs.dynamics.brake import EMERGENCY
from lgmd_gym.envs.registration import make_traffic
from lgmd_gym.envs.traffic.emergencies import HORIZON, Emergencies, scaled_emergency
from lgmd_gym.envs.traffic.env import JAM_SPEED, TrafficEnv
from lgmd_gym.sensing.sensor_array import SensorArray

TRIED_STEP = 0.2  # [s] between two of the moments from which full braking is tried, up to `PREMATURE`
TRIED_LENGTHS = (1.0, 2.0, None)  # [s], lengths of the tried braking; None for a stop
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
    def course(self) -> Branch:
        """The drive without the agent, also beyond the end."""
        end = len(self.moments) - 1
        return Branch(
            0,
            [moment.motion.speed for moment in self.moments],
            [moment.info["required_deceleration"] for moment in self.moments],
            self.contact is not None,
            lambda: self.fork(end),
            self.policy_hz,
        )

    @property
    def contact(self) -> int | None:
        """Decision of the contact without the agent; None without one."""
        return len(self.moments) - 1 if self.moments[-1].info["collision"] else None

    @property
    def scaled_emergency(self) -> float:
        """Required deceleration of an emergency, scaled to the brake of the episode [m/s²]."""
        return scaled_emergency(self.snapshots[0].brake)

    @cached_property
    def emergencies(self) -> Emergencies:
        """Emergencies up to `HORIZON` beyond the end."""
        return self.course.emergencies(self._horizon_after(len(self.moments) - 1), EMERGENCY)

    @cached_property
    def scaled_emergencies(self) -> Emergencies:
        """Emergencies scaled to the brake up to `HORIZON` beyond the end."""
        return self.course.emergencies(self._horizon_after(len(self.moments) - 1), self.scaled_emergency)

    def _horizon_after(self, decision: int) -> int:
        return decision + round(HORIZON * self.policy_hz)

    @cached_property
    def moving_and_needed(self) -> tuple[float, float, float]:
        """Time in motion, above 0.5 m/s, and its parts in which a brake is needed [s].

        The second is for `emergencies`, the third for `scaled_emergencies`.
        """
        moving = [
            index / self.policy_hz
            for index, moment in enumerate(self.moments)
            if moment.motion.speed > JAM_SPEED
        ]
        needed, scaled = (
            sum(item.time_until(time) is not None for time in moving) / self.policy_hz
            for item in (self.emergencies, self.scaled_emergencies)
        )
        return len(moving) / self.policy_hz, needed, scaled

    @cached_property
    def avoidable(self) -> bool | None:
        """Whether full braking avoids the contact without the agent; None without contact.

        It is tried every `TRIED_STEP` in the last `PREMATURE` before the contact, each of `TRIED_LENGTHS`,
        and avoids it if no contact follows up to `HORIZON` after its time. A contact of an ego that stands is
        not avoidable.
        """
        if self.contact is None:
            return None
        if self.moments[-1].info["impact_speed"] < JAM_SPEED:
            return False
        step = round(TRIED_STEP * self.policy_hz)
        onsets = range(max(self.contact - round(PREMATURE * self.policy_hz), 0), self.contact, step)
        env = self.fork(onsets[0])
        forks = [fork(env)]
        for _ in onsets[1:]:
            for _ in range(step):
                env.step_unobserved()
            forks.append(fork(env))
        end = self._horizon_after(self.contact)
        lengths = [None if length is None else round(length * self.policy_hz) for length in TRIED_LENGTHS]
        return any(
            avoids(fork(env), end - onset, length)
            for env, onset in reversed(list(zip(forks, onsets, strict=True)))
            for length in lengths
        )

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
    attention: Attention | str | None = None,
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
        attention: Errors of the drivers, or their name; None for attentive drivers.
    """
    env: Any = make_traffic(kind, camera=None, config=config, attention=attention)
    env.appearance = appearance
    reader = SceneReader(env, sensors, index, fps)
    moments, snapshots = [reader.reset(seed)], [fork(env)]
    while not moments[-1].done:
        moments.append(reader.step())
        if (len(moments) - 1) % SNAPSHOT_EVERY == 0:
            snapshots.append(fork(env))
    return TrafficRecording(kind, seed, tuple(moments), tuple(snapshots), env.config["policy_frequency"], fps)
