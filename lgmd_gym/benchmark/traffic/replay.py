"""Replay of one agent on a recording of traffic; simulated live from its first braking on."""

from lgmd_gym.agents import HOLD
from lgmd_gym.benchmark.traffic.branch import Branch, branch_from
from lgmd_gym.benchmark.traffic.reader import Moment
from lgmd_gym.benchmark.traffic.recording import TrafficRecording
from lgmd_gym.benchmark.traffic.rows import AFTERMATH, BrakingEvent, EpisodeLog
from lgmd_gym.envs.traffic.emergencies import HORIZON
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.errors import check_within

EVENT_PAUSE = 1.0  # [s] without a demand that ends a braking event, and without an alert before the next one
HANDOVER = 3.0  # [s] after a standstill during which only the driver acts
RESEED = 1_000_003  # seed offset of the agent's reset after each standstill
NEVER = -1e9  # [s]


class Replay:
    """Runs one agent on one recording.

    Until the agent brakes, it receives the recorded observations. At its first demand the recorded state is
    forked: the recording is the branch without braking, and the fork is stepped live. For every later braking
    event, a fork of the live state is stepped without braking. The difference of the speeds of both is the
    speed lost.

    A braking event ends after `EVENT_PAUSE` without a demand, or at a standstill. After a standstill only the
    driver acts for `HANDOVER`; then the agent is reset, with another seed each time, so that an agent that
    always brakes still makes progress.

    Attributes:
        recording: The recording.
        log: Events so far.
        done: Whether the episode has ended.
        demand: The last demand.
        env: The forked environment; None until the agent brakes.
    """

    def __init__(self, recording: TrafficRecording) -> None:
        self.recording = recording
        self.log = EpisodeLog()
        self.done = False
        self.demand = HOLD
        self.env: TrafficEnv | None = None
        self._seed: int | None = recording.seed  # of the reset before the agent's next decision, if any
        self._event: BrakingEvent | None = None
        self._without: Branch | None = None  # the drive without the last braking event
        self._handover_until = self._last_alert = NEVER
        self._standstills = self._next = 0

    @property
    def decision(self) -> int:
        """Number of the last decision."""
        return self._next - 1

    @property
    def driver_only(self) -> bool:
        """Whether only the driver acts at the next decision."""
        return self._next / self.recording.policy_hz < self._handover_until

    @property
    def needs_env(self) -> bool:
        """Whether the agent has braked for the first time, so that the caller has to set `env`."""
        return self.env is None and self.demand < HOLD and not self.done

    def take_seed(self) -> int | None:
        """Return the seed with which to reset the agent before its next decision; None for no reset."""
        seed, self._seed = self._seed, None
        return seed

    def process(self, moment: Moment, demand: float, alert: bool) -> None:
        """Process the next decision.

        Args:
            moment: The recorded one, or that of `env` under the last demand.
            demand: Demand of the agent in [-1, 1]; 0 if only the driver acts.
            alert: Whether the agent warns.
        """
        time = self._next / self.recording.policy_hz
        self._next += 1
        self.demand = min(check_within("demand", demand, -1.0, 1.0), HOLD)
        if alert:
            self.log.alerts += time - self._last_alert > EVENT_PAUSE
            self._last_alert = time
        self._update_event(moment, time)
        if moment.done:
            self.log.end, self.log.duration, self.done = moment, time, True
            self.log.caused = bool(moment.info["collision"]) and self._is_caused(time)

    def _update_event(self, moment: Moment, time: float) -> None:
        """Begin, continue or end the present braking event."""
        event, demand, decision = self._event, self.demand, self.decision
        if event is None and demand < HOLD:
            env = self.env
            self._without = self.recording.course if env is None else branch_from(env, decision)
            event = self._event = BrakingEvent.begin(decision, self._without, self.recording)
            self.log.events.append(event)
        if event is None:
            return
        assert self._without is not None
        speed = float(moment.info["ego_speed"])
        standstill = speed == 0.0 and time > event.start
        if demand < HOLD or standstill:
            event.last = time
        counted = event.counts
        event.peak = max(event.peak, moment.info["deceleration"])
        if event.counts and not counted and not event.needed:
            event.judge(decision, self._without, self.recording)
        event.speed_lost = max(event.speed_lost, self._without.speed(decision) - speed)
        self.log.peak = max(self.log.peak, event.peak)
        if standstill:
            self.log.stops += event.counts  # otherwise the driver has stopped
            self._standstills += 1
            self._seed = self.recording.seed + RESEED * self._standstills
            self._handover_until = time + HANDOVER
        if standstill or time - event.last > EVENT_PAUSE:
            self._event = None

    def _is_caused(self, time: float) -> bool:
        """Return whether the last braking event caused a contact at a time [s].

        It did if the contact is not later than `AFTERMATH` after it, and the drive without the event has no
        contact up to `HORIZON` later.
        """
        if self._without is None or time - self.log.events[-1].last > AFTERMATH:
            return False
        return self._without.contact(round((time + HORIZON) * self.recording.policy_hz)) is None
