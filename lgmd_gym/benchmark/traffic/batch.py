"""A batch of traffic episodes, which share the calls of their cameras and neurons."""

import traceback
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from lgmd_gym.agents import BatchAgent, make_agent
from lgmd_gym.benchmark.case import TRAFFIC, TRAFFIC_SUITES, Row, new_row, traffic_case
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.observer import Observed, Observer
from lgmd_gym.benchmark.traffic.player import AgentPlayer
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
    groups: list[tuple[SensorConfig, dict[str, BatchAgent]]] = []
    for name in names:
        agent = make_agent(name).agent
        sensor_config = task.sensor_config.for_agent(agent)
        same = [agents for known, agents in groups if known == sensor_config]
        same[0].update({name: agent}) if same else groups.append((sensor_config, {name: agent}))
    rows: dict[tuple[TrafficDrive, str], Row] = {}
    for sensor_config, agents in groups:
        rows |= _play(task.drives, _Group(agents, sensor_config, task.condition))
    return [rows[drive, agent] for drive in task.drives for agent in drive.agents]


class _Group(NamedTuple):
    """Agents with the same cameras."""

    agents: dict[str, BatchAgent]  # by name
    sensor_config: SensorConfig
    condition: str  # name of the weather, for the rows


def _play(drives: Sequence[TrafficDrive], group: _Group) -> dict[tuple[TrafficDrive, str], Row]:
    """Return the rows of the agents of a group in all drives.

    An exception that belongs to no single drive, of an agent or of the cameras, ends a batch without rows.
    The drives are then played one by one, so that the error belongs to those that cause it.
    """
    chosen = [drive for drive in drives if group.agents.keys() & {*drive.agents}]
    rows = _Batch(chosen, group).play()
    for drive in chosen:
        for name in drive.agents:
            if name in group.agents and (drive, name) not in rows:
                # Made anew: attributes of its own may hold what is left of the batch.
                alone = group._replace(agents={name: make_agent(name).agent})
                rows |= _Batch([drive], alone).play()
    return rows


class _PlayedDrive:
    """A drive during its play, with the agents that share its recording.

    Attributes:
        drive: The drive.
        rows: Rows of the finished agents, by agent.
        replays: Unfinished replays, by agent.
    """

    def __init__(self, drive: TrafficDrive, group: _Group, observer: Observer, index: int) -> None:
        self.drive = drive
        self.rows: dict[str, Row] = {}
        self.replays: dict[str, Replay] = {}
        self._moments: tuple[Moment, ...] = ()
        self._group, self._observer, self._index = group, observer, index
        self._reader: SceneReader | None = None  # of the last agent, from its first braking on
        agents = [name for name in drive.agents if name in group.agents]
        try:
            attention = TRAFFIC_SUITES[drive.suite]
            recording = record_traffic(
                *(drive.kind, drive.seed, observer.sensors, index, observer.fps, drive.appearance),
                attention=attention,
            )
        except Exception:
            self._fail(agents)
            return
        self._moments = recording.moments
        self.replays = {name: Replay(recording) for name in agents}

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
            self._fail(list(self.replays))
            return None

    def proceed(self, agent: str, player: AgentPlayer) -> None:
        """Fork the recording at an agent's first braking, and add the row of a finished replay.

        The last agent continues with the sensors of the recording. Others still need the recorded frames of
        earlier agents, so that these draw the frames so far again and play to the end.
        """
        replay = self.replays[agent]
        try:
            if replay.needs_env and len(self.replays) == 1:
                replay.env = replay.recording.fork(replay.decision)
            elif replay.needs_env:
                player.play_alone(replay, self._index, self._group.sensor_config)
            if replay.done:
                label = self._group.sensor_config.label
                self.add(agent, **measure(replay.recording, replay.log), camera=label)
        except (Exception, SystemExit):  # an agent that calls exit() would end the worker process
            self._fail([agent])

    def add(self, agent: str, **values: object) -> None:
        """Add the row of an agent, which ends its replay."""
        self.replays.pop(agent, None)
        drive = self.drive
        case = traffic_case(drive.kind, drive.seed, drive.suite)
        world = check_world(drive.appearance.world)
        condition = self._group.condition
        self.rows[agent] = new_row(KEYS, agent, case, drive.seed, condition, world=world, **values)

    def _fail(self, agents: list[str]) -> None:
        """End the replays of agents with the present exception."""
        for agent in agents:
            self.add(agent, error=traceback.format_exc())


class _Batch:
    """The drives of a group during their play, which share the calls of the cameras, neurons and agents.

    Args:
        drives: The drives.
        group: The agents.
    """

    def __init__(self, drives: list[TrafficDrive], group: _Group) -> None:
        self._observer = Observer(group.sensor_config, len(drives))
        self._drives = [
            _PlayedDrive(drive, group, self._observer, index) for index, drive in enumerate(drives)
        ]
        self._agents = group.agents

    def play(self) -> dict[tuple[TrafficDrive, str], Row]:
        """Play the drives and return the rows by drive and agent; rows may be missing, see `_play`."""
        try:
            players = {name: AgentPlayer(agent, len(self._drives)) for name, agent in self._agents.items()}
            decision = 0
            while any(moments := [drive.moment(decision) for drive in self._drives]):
                observed = self._observer.observe(moments)
                for name, player in players.items():
                    self._process(name, player, observed)
                decision += 1
        except (Exception, SystemExit):
            self._fail(*self._agents)
        return {(played.drive, name): row for played in self._drives for name, row in played.rows.items()}

    def _process(self, name: str, player: AgentPlayer, observed: Observed) -> None:
        """Process one decision of an agent in all drives."""
        replays = [
            drive.replays.get(name) if moment is not None else None
            for drive, moment in zip(self._drives, observed.moments, strict=True)
        ]
        try:
            failures = player.process(observed, replays)
        except (Exception, SystemExit):
            self._fail(name)
            return
        for index, (drive, replay) in enumerate(zip(self._drives, replays, strict=True)):
            if index in failures:
                drive.add(name, error="".join(traceback.format_exception(failures[index])))
            elif replay is not None:
                drive.proceed(name, player)

    def _fail(self, *agents: str) -> None:
        """End the replays of agents with the present exception; without a row if there are several drives."""
        for drive in self._drives:
            for name in drive.replays.keys() & set(agents):
                if len(self._drives) == 1:
                    drive.add(name, error=traceback.format_exc())
                else:
                    del drive.replays[name]
