"""Replay of one agent on a recording of traffic; simulated live from its first braking on."""

from lgmd_gym.agents import HOLD
from lgmd_gym.agents.base import Driver
from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.branch import Branch, branch_from
from lgmd_gym.benchmark.traffic.observer import Observer
from lgmd_gym.benchmark.traffic.reader import SceneReader
from lgmd_gym.benchmark.traffic.recording import TrafficRecording
from lgmd_gym.benchmark.traffic.rows import AFTERMATH, BrakingEvent, EpisodeLog
from lgmd_gym.envs.traffic.emergencies import HORIZON
from lgmd_gym.envs.traffic.env import TrafficEnv

EVENT_PAUSE = 1.0  # [s] without a demand that ends a braking event, and without an alert before the next one
HANDOVER = 3.0  # [s] after a standstill during which only the driver acts
RESEED = 1_000_003  # seed offset of the agent's reset after each standstill
NEVER = -1e9  # [s]


class LiveEpisode:
    """An episode of traffic that continues from a decision of a recording; all cameras are drawn."""

    def __init__(self, recording: TrafficRecording, decision: int, sensor_config: SensorConfig) -> None:
        self.env = recording.fork(decision)
        self._observer = Observer(sensor_config)
        sensors = self._observer.sensors
        sensors.set_scene(0, self.env.scene, self.env.brake.max_deceleration)
        sensors.set_road(0, self.env.road)
        for moment in recording.moments[: decision + 1]:
            (self.start,) = self._observer.observe([moment])
        self._reader = SceneReader(self.env, sensors, 0, recording.fps, decision)

    def step(self, demand: float) -> Step:
        """Advance by one decision."""
        (step,) = self._observer.observe([self._reader.step(demand)])
        assert step is not None
        return step


class Replay:
    """Runs one agent on one recording.

    Until the agent brakes, it receives the recorded steps. At its first demand the recorded state is forked:
    the recording is the branch without braking, and the fork is stepped live. The caller does that with the
    sensors of the recording if no other agent needs them; otherwise the replay draws the frames so far again
    and plays to the end. For every later braking event, a fork of the live state is stepped without braking.
    The difference of the speeds of both is the speed lost.

    A braking event ends after `EVENT_PAUSE` without a demand, or at a standstill. After a standstill only the
    driver acts for `HANDOVER`; then the agent is reset, with another seed each time, so that an agent that
    always brakes still makes progress.

    Attributes:
        log: Events so far.
        done: Whether the episode has ended.
        demand: The last demand.
        env: The forked environment; None until the agent brakes.
    """

    def __init__(self, recording: TrafficRecording, agent: Driver, sensor_config: SensorConfig) -> None:
        self.recording, self.agent, self.sensor_config = recording, agent, sensor_config
        self.log = EpisodeLog()
        self.done = False
        self.demand = HOLD
        self.env: TrafficEnv | None = None
        self._event: BrakingEvent | None = None
        self._without: Branch | None = None  # the drive without the last braking event
        self._handover_until = self._last_alert = NEVER
        self._standstills = self._decision = 0
        agent.reset(recording.seed)

    def process(self, step: Step, last: bool = False) -> None:
        """Process the step of the next decision.

        Args:
            step: The recorded step, or that of `env` under the last demand.
            last: Whether the caller steps `env` if the agent brakes; otherwise this method does, to the end.
        """
        self.demand = self._process(step)
        if self.done or self.demand == HOLD or self.env is not None:
            return
        decision = self._decision - 1
        if last:
            self.env = self.recording.fork(decision)
            return
        live = LiveEpisode(self.recording, decision, self.sensor_config)
        self.env = live.env
        while not self.done:
            self.demand = self._process(live.step(self.demand))

    def _process(self, step: Step) -> float:
        """Process the step of a decision and return the demand."""
        time = self._decision / self.recording.policy_hz
        self._decision += 1
        demand = self._demand(step, time)
        self._update_event(step, time, demand)
        if step.done:
            self.log.end, self.log.duration, self.done = step, time, True
            self.log.caused = bool(step.info["collision"]) and self._is_caused(time)
        return demand

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
        event, decision = self._event, self._decision - 1
        if event is None and demand < HOLD:
            env = self.env
            self._without = self.recording.course if env is None else branch_from(env, decision)
            event = self._event = BrakingEvent.begin(decision, self._without, self.recording)
            self.log.events.append(event)
        if event is None:
            return
        assert self._without is not None
        speed = float(step.info["ego_speed"])
        standstill = speed == 0.0 and time > event.start
        if demand < HOLD or standstill:
            event.last = time
        counted = event.counts
        event.peak = max(event.peak, step.info["deceleration"])
        if event.counts and not counted and not event.needed:
            event.judge(decision, self._without, self.recording)
        event.speed_lost = max(event.speed_lost, self._without.speed(decision) - speed)
        self.log.peak = max(self.log.peak, event.peak)
        if standstill:
            self.log.stops += event.counts  # otherwise the driver has stopped
            self._standstills += 1
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
