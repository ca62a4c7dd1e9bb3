"""A batch of traffic episodes, which share the calls of their cameras and neurons."""

import traceback
from dataclasses import dataclass

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.case import TRAFFIC, TRAFFIC_SUITES, Row, new_row, traffic_case
from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.observer import Observer
from lgmd_gym.benchmark.traffic.reader import Moment, SceneReader
from lgmd_gym.benchmark.traffic.recording import record_traffic
from lgmd_gym.benchmark.traffic.replay import Replay
from lgmd_gym.benchmark.traffic.rows import KEYS, measure
from lgmd_gym.camera import CLEAR
from lgmd_gym.camera.worlds import LABORATORY, check_world
from lgmd_gym.envs.appearance import Appearance

IN_LABORATORY = Appearance(world=LABORATORY)


@dataclass(frozen=True, slots=True)
class TrafficDrive:
    """One seed of a kind of traffic and the agents to run in it."""

    kind: str  # kind of traffic
    seed: int  # seed of the traffic and the agents
    agents: tuple[str, ...]
    appearance: Appearance = IN_LABORATORY  # world, weather and road; the world must not be None
    suite: str = TRAFFIC  # name of the suite, which determines the attention of the drivers


@dataclass(frozen=True, slots=True)
class TrafficTask:
    """A batch of drives under one condition."""

    drives: tuple[TrafficDrive, ...]
    sensor_config: SensorConfig  # camera and neuron parameters
    condition: str = CLEAR  # name of the weather, for the rows


def run_traffic_task(task: TrafficTask) -> list[Row]:
    """Return the row of every agent in every drive; an exception becomes an error row.

    All agents with the same cameras share a recording.
    """
    names = dict.fromkeys(agent for drive in task.drives for agent in drive.agents)
    sensor_configs = {name: task.sensor_config.for_agent(make_agent(name)) for name in names}
    groups: list[tuple[SensorConfig, list[str]]] = []
    for name, sensor_config in sensor_configs.items():
        same = [agents for known, agents in groups if known == sensor_config]
        same[0].append(name) if same else groups.append((sensor_config, [name]))
    rows: dict[tuple[TrafficDrive, str], Row] = {}
    for sensor_config, agents in groups:
        for drive in _play(task, sensor_config, set(agents)):
            rows |= {(drive.drive, agent): row for agent, row in drive.rows.items()}
    return [rows[drive, agent] for drive in task.drives for agent in drive.agents]


class _PlayedDrive:
    """A drive during its play, with the agents that share its recording.

    Attributes:
        drive: The drive.
        rows: Rows of the finished agents, by agent.
        replays: Unfinished replays, by agent.
    """

    def __init__(
        self,
        drive: TrafficDrive,
        agents: list[str],
        task: TrafficTask,
        sensor_config: SensorConfig,
        observer: Observer,
        index: int,
    ) -> None:
        self.drive = drive
        self.rows: dict[str, Row] = {}
        self.replays: dict[str, Replay] = {}
        self._moments: tuple[Moment, ...] = ()
        self._observer, self._index = observer, index
        self._reader: SceneReader | None = None  # of the last agent, from its first braking on
        self._agents, self._condition, self._label = agents, task.condition, sensor_config.label
        try:
            attention = TRAFFIC_SUITES[drive.suite]
            recording = record_traffic(
                *(drive.kind, drive.seed, observer.sensors, index, observer.fps, drive.appearance),
                attention=attention,
            )
            playing = {name: make_agent(name) for name in agents}
        except Exception:
            self.fail()
            return
        self._moments = recording.moments
        self.replays = {name: Replay(recording, agent, sensor_config) for name, agent in playing.items()}

    def moment(self, decision: int) -> Moment | None:
        """Return what the sensors draw next: a decision of the recording, or of the last agent's drive."""
        if not self.replays:
            return None
        (replay, *others) = self.replays.values()
        if others or replay.env is None:
            return self._moments[decision]
        if self._reader is None:
            observer = self._observer
            self._reader = SceneReader(replay.env, observer.sensors, self._index, observer.fps, decision - 1)
        try:
            return self._reader.step(replay.demand)
        except Exception:
            self.fail()
            return None

    def process(self, step: Step) -> None:
        """Give the step of the next decision to the agents."""
        for agent, replay in list(self.replays.items()):
            try:
                replay.process(step, last=len(self.replays) == 1)
                if replay.done:
                    self._add(agent, **measure(replay.recording, replay.log), camera=self._label)
            except Exception:
                self._add(agent, error=traceback.format_exc())

    def fail(self) -> None:
        """End all unfinished agents with the present exception."""
        for agent in self._agents:
            if agent not in self.rows:
                self._add(agent, error=traceback.format_exc())

    def _add(self, agent: str, **values: object) -> None:
        """Add the row of an agent, which ends its replay."""
        self.replays.pop(agent, None)
        drive = self.drive
        case = traffic_case(drive.kind, drive.seed, drive.suite)
        world = check_world(drive.appearance.world)
        self.rows[agent] = new_row(KEYS, agent, case, drive.seed, self._condition, world=world, **values)


def _play(task: TrafficTask, sensor_config: SensorConfig, agents: set[str]) -> list[_PlayedDrive]:
    """Play the drives with some agents, which have the same cameras."""
    chosen = [
        (drive, [agent for agent in drive.agents if agent in agents])
        for drive in task.drives
        if agents.intersection(drive.agents)
    ]
    observer = Observer(sensor_config, len(chosen))
    drives = [
        _PlayedDrive(drive, names, task, sensor_config, observer, index)
        for index, (drive, names) in enumerate(chosen)
    ]
    try:
        decision = 0
        while any(drive.replays for drive in drives):
            moments = [drive.moment(decision) for drive in drives]
            if not any(moments):
                break
            for drive, step in zip(drives, observer.observe(moments), strict=True):
                if step is not None:
                    drive.process(step)
            decision += 1
    except Exception:  # of the cameras
        for drive in drives:
            drive.fail()
    return drives
