"""One agent through one recorded drive: it watches until it first brakes, then goes its own way."""

import gymnasium as gym

from lgmd_gym.agents import HOLD, Agent, to_action
from lgmd_gym.benchmark.traffic.recording import Seen, Trace, look_ahead
from lgmd_gym.benchmark.traffic.rows import Braking, Log

RELEASE = 1.0  # [s] without a demand after which braking is over, and without an alert for the next to count
HANDOVER = 3.0  # [s] after a standstill in which the driver is left alone
RESEED = 1_000_003  # an agent that has come to a standstill draws anew


class Ride:
    """Plays one agent on one trace.

    While the agent does not brake it is shown the recording. At its first demand the recorded state is
    forked: the branch without braking is the recording itself, the other one goes on live. Every further
    braking is judged by a fork of the live state, driven on without braking.

    A braking lasts until the agent has asked for none for `RELEASE`, or to a standstill. After a standstill
    the driver is left alone for `HANDOVER`, then the agent is reset (with a seed of its own for every
    standstill), so that an agent that keeps braking still drives on.

    Args:
        trace: The recording.
        agent: Who brakes.
        live: Leave the recording at once, to check that this changes nothing.
    """

    def __init__(self, trace: Trace, agent: Agent, live: bool = False) -> None:
        self.trace, self.agent = trace, agent
        self.log = Log()
        self.env: gym.Env | None = trace.fork(0) if live else None
        self._open: Braking | None = None
        self._alone_until = self._last_alert = -1e9
        self._resets = 0
        self._done = False

    def play(self) -> Log:
        """Play to the end of the drive."""
        self.agent.reset(self.trace.seed)
        seen, decision = self.trace.seen[0], 0
        while True:
            time = decision / self.trace.policy_hz
            wish = self._ask(seen, time)
            self._note(seen, time, wish)
            if self._done:
                break
            seen = self._go(decision, wish)
            decision += 1
        self.log.end, self.log.duration = seen, time
        return self.log

    def _ask(self, seen: Seen, time: float) -> float:
        """Return the agent's demand in [-1, 0]."""
        if time < self._alone_until:
            return HOLD
        if self._alone_until > 0.0:
            self.agent.reset(self.trace.seed + RESEED * self._resets)
            self._alone_until = -1e9
        wish = min(float(self.agent.act(*seen)[0]), HOLD)
        if self.agent.alert:
            self.log.alerts += time - self._last_alert > RELEASE
            self._last_alert = time
        return wish

    def _note(self, seen: Seen, time: float, wish: float) -> None:
        """Open, continue or close the present braking."""
        now = self._open
        if now is None and wish < HOLD:
            now = self._open = Braking(time, self._need(time), time)
            self.log.brakings.append(now)
        if now is None:
            return
        if wish < HOLD:
            now.last = time
        now.peak = max(now.peak, seen.info["deceleration"])
        self.log.peak = max(self.log.peak, now.peak)
        stopped = seen.info["ego_speed"] == 0.0 and time > now.start
        if stopped:
            self.log.stops += now.felt  # if not, the driver has stopped by himself
            self._resets += 1
            self._alone_until = time + HANDOVER
        if stopped or time - now.last > RELEASE:
            self._open = None

    def _need(self, time: float) -> float | None:
        """Return the time to the next emergency without braking [s], None for none."""
        if self.env is None:
            return self.trace.emergencies.need(time)
        return look_ahead(self.env, time).need(time)

    def _go(self, decision: int, wish: float) -> Seen:
        """Advance by one decision."""
        if self.env is None and wish < HOLD:
            self.env = self.trace.fork(decision)
        if self.env is None:
            self._done = decision + 2 == len(self.trace.seen)
            return self.trace.seen[decision + 1]
        observation, _, terminated, truncated, info = self.env.step(to_action(wish))
        self._done = terminated or truncated
        return Seen(observation, info)
