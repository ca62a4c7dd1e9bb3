"""Replay of one agent on a recording of traffic; simulated live from its first braking on."""

import gymnasium as gym

from lgmd_gym.agents import HOLD, Agent, to_action
from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.traffic.recording import TrafficRecording, look_ahead
from lgmd_gym.benchmark.traffic.rows import BrakingEvent, EpisodeLog

EVENT_PAUSE = 1.0  # [s] without a demand that ends a braking event, and without an alert before the next one
HANDOVER = 3.0  # [s] after a standstill during which only the driver acts
RESEED = 1_000_003  # seed offset of the agent's reset after each standstill
NEVER = -1e9  # [s]


class Replay:
    """Runs one agent on one recording.

    Until the agent brakes, it receives the recorded steps. At its first demand the recorded state is forked:
    the recording is the branch without braking, and the fork is stepped live. For every later braking event,
    a fork of the live state is stepped without braking.

    A braking event ends after `EVENT_PAUSE` without a demand, or at a standstill. After a standstill only the
    driver acts for `HANDOVER`; then the agent is reset, with another seed each time, so that an agent that
    always brakes still makes progress.

    Args:
        recording: Recording to replay.
        agent: Agent to run.
        live: Whether to step live from the start, to verify that the result is the same.
    """

    def __init__(self, recording: TrafficRecording, agent: Agent, live: bool = False) -> None:
        self.recording, self.agent = recording, agent
        self.log = EpisodeLog()
        self.env: gym.Env | None = recording.fork(0) if live else None
        self._event: BrakingEvent | None = None
        self._handover_until = self._last_alert = NEVER
        self._standstills = 0
        self._done = False

    def play(self) -> EpisodeLog:
        """Run to the end of the episode."""
        self.agent.reset(self.recording.seed)
        step, decision = self.recording.steps[0], 0
        while True:
            time = decision / self.recording.policy_hz
            demand = self._demand(step, time)
            self._update_event(step, time, demand)
            if self._done:
                break
            step = self._advance(decision, demand)
            decision += 1
        self.log.end, self.log.duration = step, time
        return self.log

    def _demand(self, step: Step, time: float) -> float:
        """Return the agent's demand in [-1, 0]."""
        if time < self._handover_until:
            return HOLD
        if self._handover_until > 0.0:
            self.agent.reset(self.recording.seed + RESEED * self._standstills)
            self._handover_until = NEVER
        demand = min(float(self.agent.act(step.observation, step.info)[0]), HOLD)
        if self.agent.alert:
            self.log.alerts += time - self._last_alert > EVENT_PAUSE
            self._last_alert = time
        return demand

    def _update_event(self, step: Step, time: float, demand: float) -> None:
        """Begin, continue or end the present braking event."""
        event = self._event
        if event is None and demand < HOLD:
            event = self._event = BrakingEvent(time, self._time_to_emergency(time), time)
            self.log.events.append(event)
        if event is None:
            return
        if demand < HOLD:
            event.last = time
        event.peak = max(event.peak, step.info["deceleration"])
        self.log.peak = max(self.log.peak, event.peak)
        standstill = step.info["ego_speed"] == 0.0 and time > event.start
        if standstill:
            self.log.stops += event.counts  # otherwise the driver has stopped
            self._standstills += 1
            self._handover_until = time + HANDOVER
        if standstill or time - event.last > EVENT_PAUSE:
            self._event = None

    def _time_to_emergency(self, time: float) -> float | None:
        """Return the time to the next emergency without braking [s], or None if there is none."""
        if self.env is None:
            return self.recording.emergencies.time_until(time)
        return look_ahead(self.env, time).time_until(time)

    def _advance(self, decision: int, demand: float) -> Step:
        """Advance by one decision."""
        if self.env is None and demand < HOLD:
            self.env = self.recording.fork(decision)
        if self.env is None:
            step = self.recording.steps[decision + 1]
        else:
            observation, reward, terminated, truncated, info = self.env.step(to_action(demand))
            step = Step(observation, info, float(reward), terminated or truncated)
        self._done = step.done
        return step
