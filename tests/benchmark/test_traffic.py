"""The traffic suite: recordings, forks, replays and false activations."""

import json
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.traffic import Recorded, step_of

from lgmd_gym.agents import BRAKE, HOLD, BatchAgent, make_agent, to_action
from lgmd_gym.benchmark.episode import Step, rollout
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic import player
from lgmd_gym.benchmark.traffic.batch import TrafficDrive, TrafficTask, run_traffic_task
from lgmd_gym.benchmark.traffic.branch import branch_from, fork
from lgmd_gym.benchmark.traffic.player import LiveEpisode
from lgmd_gym.benchmark.traffic.replay import RESEED
from lgmd_gym.benchmark.traffic.rows import KEYS, BrakingEvent, measure
from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.dynamics.brake import draw_brake
from lgmd_gym.envs.registration import TRAFFIC_KINDS, register_traffic, traffic_id
from lgmd_gym.envs.traffic.emergencies import Emergencies

SENSORS = SensorConfig()
SHORT = {"duration": 12}


class BrakeDuring:
    """Brakes in the given intervals [s], and not at all after a reset that follows a standstill."""

    alert = False

    def __init__(self, *intervals, level=BRAKE):
        self.intervals, self.level, self.reset_seeds = intervals, level, []

    def reset(self, seed=None):
        self.decision = 0
        self.reset_seeds.append(seed)

    def act(self, observation, info):
        time = self.decision / 30
        self.decision += 1
        brakes = any(start <= time < end for start, end in self.intervals)
        return to_action(self.level if brakes and len(self.reset_seeds) == 1 else HOLD)


def without_trace(info):
    """Return the values of `info` that can be compared with ==."""
    return {key: value for key, value in info.items() if key != "lgmd/trace"}


@pytest.fixture(scope="module")
def merge():
    return Recorded("merge", config=SHORT)


@pytest.fixture
def wall_kinds(monkeypatch):
    """Registers an empty road as "empty" and one with a stationary car 50 m ahead as "wall"."""
    monkeypatch.setitem(TRAFFIC_KINDS, "empty", "support.traffic:EmptyHighway")
    monkeypatch.setitem(TRAFFIC_KINDS, "wall", "support.traffic:BlockedHighway")
    register_traffic()
    yield
    for kind in ("empty", "wall"):
        del gym.registry[traffic_id(kind)]


def play(kind, agent, seconds=12):
    """Return the log and the measured values of an agent in a kind of traffic."""
    recorded = Recorded(kind, config={"duration": seconds})
    log = recorded.replay(agent).log
    return log, measure(recorded.recording, log)


def same_inputs(step, other):
    """Return whether an agent receives the same observation, info and trace in two steps."""
    frames, others = step.info["lgmd/trace"], other.info["lgmd/trace"]
    return (
        step.observation.keys() == other.observation.keys()
        and all(np.array_equal(step.observation[key], other.observation[key]) for key in step.observation)
        and without_trace(step.info) == without_trace(other.info)
        and [frame[:2] for frame in frames] == [frame[:2] for frame in others]
        and all(np.array_equal(a.response, b.response) for a, b in zip(frames, others, strict=True))
    )


def test_fork_repeats_the_recording_bit_for_bit(merge):
    """The decisions are at, shortly after, and far from a snapshot."""
    recording = merge.recording
    for decision in (0, 37, 300, 313):
        env = recording.fork(decision)
        for later in range(decision + 1, decision + 40):
            assert env.advance()[0] == recording.moments[later].info


def test_fork_is_independent_of_its_original(merge):
    env = merge.recording.fork(60)
    other = fork(env)
    before = env.ego.position.tolist(), env.steps
    for _ in range(20):
        braked = other.step(to_action(BRAKE))[4]
    branch_from(env, 60).speed(90)
    assert (env.ego.position.tolist(), env.steps) == before
    assert braked["ego_speed"] < env.ego.speed
    for _ in range(20):
        env.step(to_action(HOLD))
    assert env.ego.speed == merge.recording.moments[80].motion.speed


def test_fork_that_differs_from_the_recording_is_rejected(merge):
    moments = list(merge.recording.moments)
    moments[9] = moments[10]
    with pytest.raises(RuntimeError, match="merge traffic, seed 0 does not repeat at decision 9"):
        replace(merge.recording, moments=tuple(moments)).fork(9)


@pytest.mark.parametrize("camera", ["fovea", ["wide", "tele"], "birdseye"])
def test_recorded_steps_equal_those_of_the_wrapper(camera):
    config = {"duration": 3}
    recorded = Recorded("two-way", 1, SensorConfig(camera), config)
    env = gym.make(traffic_id("two-way"), camera=camera, trace=True, config=config, world="laboratory")
    steps = [step for step, _ in rollout(env, make_agent("no-brake"), 1)]
    assert len(steps) == len(recorded.steps) == 3 * 30 + 1
    assert all(same_inputs(step, other) for step, other in zip(recorded.steps, steps, strict=True))
    assert [step.done for step in recorded.steps] == [step.done for step in steps]


@pytest.mark.parametrize("decision", [0, 45])
def test_live_episode_continues_a_recording(merge, decision):
    live = LiveEpisode(merge.recording, decision, merge.sensor_config)
    for later in range(decision + 1, decision + 20):
        assert same_inputs(step_of(live.step(HOLD)), merge.steps[later])


def test_live_episode_observes_the_same_as_the_wrapper_while_braking(merge):
    live = LiveEpisode(merge.recording, 0, merge.sensor_config)
    env = gym.make(traffic_id("merge"), camera="fovea", trace=True, config=SHORT, world="laboratory")
    env.reset(seed=0)
    for _ in range(40):
        observation, _, terminated, truncated, info = env.step(to_action(BRAKE))
        assert same_inputs(step_of(live.step(BRAKE)), Step(observation, info, 0.0, terminated or truncated))


def test_live_episode_continues_in_the_world_of_the_recording():
    """Also the brake is that of the world, which is wet in the rain."""
    appearance = Appearance(world=8003, weather="rain")
    recorded = Recorded("merge", 0, SENSORS, {"duration": 6}, appearance)
    live = LiveEpisode(recorded.recording, 30, SENSORS)
    assert live.env.brake == draw_brake(8003, wet=True)
    steps = [step_of(live.step(HOLD)) for _ in range(20)]
    assert all(map(same_inputs, steps, recorded.steps[31:]))
    env = gym.make(
        traffic_id("merge"), camera="fovea", trace=True, config={"duration": 6}, world=8003, weather="rain"
    )
    env.reset(seed=0)
    for step in recorded.steps[1:20]:
        observation, _, terminated, truncated, info = env.step(to_action(HOLD))
        assert same_inputs(step, Step(observation, info, 0.0, terminated or truncated))


def single_rows(drives):
    """Return the rows of every agent alone in every drive."""
    return [
        run_traffic_task(TrafficTask((replace(drive, agents=(agent,)),), SENSORS))[0]
        for drive in drives
        for agent in drive.agents
    ]


def test_rows_of_a_batch_equal_those_of_single_drives(wall_kinds):
    agents = ("random-brake:rate=0.5", f"{__name__}:RareBrake", "spike-threshold", "stopping-zone")
    drives = tuple(
        TrafficDrive(kind, 1, names)
        for kind, names in (("merge", agents[1:]), ("intersection", agents), ("wall", agents[:3]))
    )
    batch = run_traffic_task(TrafficTask(drives, SENSORS))
    assert [row["error"] for row in batch] == [None] * 10
    assert batch == single_rows(drives)
    assert {row["agent"] for row in batch if row["brakes"] > 0} == {*agents}
    assert sum(row["stops"] for row in batch) > 1  # the agents were reset in some drives


class RareBrake:
    """Brakes for 0.2 s of every 2 s, at times that differ from reset to reset."""

    def reset(self, seed):
        self.decision = seed % 60

    def act(self, observation, info):
        assert info["lgmd/trace"][-1].ego_speed == info["ego_speed"]
        self.decision += 1
        return -0.8 if self.decision % 60 < 6 else 0.0


class FailsAbove(RareBrake):
    """Fails at a speed above 24 m/s, which the ego has on the road with the wall only."""

    error = RuntimeError

    def act(self, observation, info):
        if info["ego_speed"] > 24.0:
            raise self.error("too fast")
        return super().act(observation, info)


class ExitsAbove(FailsAbove):
    error = SystemExit


class FailsTogether(BatchAgent):
    """Fails in all episodes if one ego is faster than 24 m/s, but only once."""

    def __init__(self):
        super().__init__()
        self.failed = []  # agents for other numbers of environments share it

    def demands(self, observations, infos, active):
        if infos["ego_speed"][active].max() > 24.0 and not self.failed:
            self.failed.append(True)
            raise RuntimeError("too fast")
        return np.zeros(self.num_envs)


@pytest.mark.parametrize("others", [(), ("spike-threshold",)])
@pytest.mark.parametrize("failing", ["FailsAbove", "ExitsAbove", "FailsTogether"])
def test_an_agent_that_fails_in_one_drive_leaves_the_others(wall_kinds, failing, others):
    agents = (f"{__name__}:{failing}", *others)
    drives = (TrafficDrive("intersection", 1, agents), TrafficDrive("wall", 0, agents))
    rows = run_traffic_task(TrafficTask(drives, SENSORS))
    assert [row["error"] is None for row in rows] == [*[True] * len(agents), False, *[True] * len(others)]
    failed = rows[len(agents)]
    assert "too fast" in failed["error"]
    assert rows[: len(agents)] == single_rows(drives[:1])


def test_failure_in_one_drive_leaves_the_others(monkeypatch, wall_kinds):
    monkeypatch.setitem(TRAFFIC_KINDS, "empty", "support.traffic:Missing")
    drives = (TrafficDrive("empty", 0, ("no-brake",)), TrafficDrive("wall", 0, ("no-brake",)))
    failed, played = run_traffic_task(TrafficTask(drives, SENSORS))
    assert "Missing" in failed["error"]
    assert played["error"] is None
    assert played["collision"]


def test_braking_for_a_stationary_car_is_necessary_and_avoids_contact(wall_kinds):
    log, row = play("wall", BrakeDuring((0.0, 6.0)))
    assert row["threat"]
    assert row["avoided"] is True
    assert not row["collision"]
    assert (row["brakes"], row["false_activations"], row["stops"]) == (1, 0, 1)
    # At 25 m/s, 50 - 2.15 - 2.5 m behind the stationary car, 6.9 m/s² are required.
    assert log.events[0].time_to_emergency == 0.0
    assert 2.0 < row["peak_deceleration"] <= 9.0


def test_late_braking_for_a_stationary_car_ends_in_contact(wall_kinds):
    _, row = play("wall", BrakeDuring((2.4, 6.0)))
    assert row["collision"]
    assert row["avoided"] is False
    assert row["side"] == "front"
    assert 0.0 < row["impact_speed"] < 25.0


def test_braking_on_an_empty_road_is_false_and_the_episode_continues(wall_kinds):
    agent = BrakeDuring((1.0, 2.0), (3.5, 9.0))
    log, row = play("empty", agent, 20)
    assert not row["threat"]
    assert row["avoided"] is None
    assert (row["brakes"], row["false_activations"], row["stops"]) == (2, 2, 1)
    assert row["peak_deceleration"] == pytest.approx(9.0)
    assert [event.time_to_emergency for event in log.events] == [None, None]
    assert agent.reset_seeds == [0, RESEED]
    assert log.end.info["ego_speed"] > 10.0
    assert row["duration"] == 20.0
    assert json.loads(json.dumps(row, allow_nan=False)) == row
    assert set(row) < set(KEYS)


@pytest.mark.parametrize(("level", "count"), [(-0.2, 0), (-0.4, 1)])
def test_braking_counts_above_a_quarter_g(wall_kinds, level, count):
    """The levels are 1.8 and 3.6 m/s²."""
    _, row = play("empty", BrakeDuring((1.0, 2.0), level=level), 5)
    assert row["brakes"] == row["false_activations"] == count
    assert row["peak_deceleration"] == pytest.approx(-9.0 * level, abs=0.02)


def test_demands_less_than_a_second_apart_are_one_braking_event(wall_kinds):
    _, row = play("empty", BrakeDuring((1.0, 1.3), (1.6, 1.9), (2.5, 2.8)), 6)
    assert row["brakes"] == 1


def test_always_brake_makes_progress():
    _, row = play("two-way", make_agent("always-brake"), 16)
    assert row["brakes"] >= 3
    assert row["brakes"] - row["stops"] in (0, 1)
    assert row["distance"] > 40.0


def test_time_to_the_next_emergency_within_the_horizon():
    emergencies = Emergencies(contact=20.0, demanding=(5.0, 5.5))
    assert emergencies.time_until(2.0) == 3.0
    assert emergencies.time_until(1.9) is None
    assert emergencies.time_until(1.9, 10.0) == pytest.approx(3.1)
    assert emergencies.time_until(5.0) == 0.0
    assert emergencies.time_until(5.2) == pytest.approx(0.3)
    assert emergencies.time_until(5.6) is None
    assert emergencies.time_until(17.0) == 3.0
    assert emergencies.time_until(16.9) is None
    assert emergencies.time_until(20.1) is None
    assert Emergencies(None, ()).time_until(0.0) is None


@pytest.mark.parametrize(
    ("time", "peak", "false"), [(None, 9.0, True), (None, 2.0, False), (2.9, 9.0, False)]
)
def test_braking_is_false_if_it_counts_and_is_not_needed(time, peak, false):
    assert BrakingEvent(start=0.0, time_to_emergency=time, last=0.0, peak=peak).false is false


def test_time_in_which_a_brake_is_needed(wall_kinds):
    """The ego of "wall" has contact after less than 3 s; that of "empty" is never in need."""
    recording = Recorded("wall", config={"duration": 12}).recording
    moving, needed, scaled = recording.moving_and_needed
    assert moving == needed == scaled == len(recording.moments) / 30
    moving, needed, scaled = Recorded("empty", config={"duration": 12}).recording.moving_and_needed
    assert (moving, needed, scaled) == (pytest.approx(12.0, abs=0.1), 0.0, 0.0)


def test_hard_braking_of_the_driver_without_a_conflict_is_no_emergency():
    """At intersections, IDM brakes by more than 5 m/s² to give way to cars that will have passed."""
    recording = Recorded("intersection", 2).recording
    driver = np.array([moment.info["driver_acceleration"] for moment in recording.moments])
    required = np.array([moment.info["required_deceleration"] for moment in recording.moments])
    assert (driver <= -5.0).sum() > 10
    assert (required[driver <= -5.0] < 5.0).any()
    moving, needed, _ = recording.moving_and_needed
    assert needed < 0.3 * moving


def test_the_last_agent_of_a_drive_uses_the_sensors_of_the_recording(monkeypatch):
    """It draws no frame twice; the row is that of an agent that shares the recording."""
    made = []
    monkeypatch.setattr(
        player, "LiveEpisode", lambda *arguments: made.append(LiveEpisode(*arguments)) or made[-1]
    )
    drive = TrafficDrive("intersection", 1, ("spike-threshold",))
    (alone,) = run_traffic_task(TrafficTask((drive,), SENSORS))
    assert (made, alone["brakes"] > 0) == ([], True)
    both = run_traffic_task(TrafficTask((replace(drive, agents=("spike-threshold", "no-brake")),), SENSORS))
    assert len(made) == 1
    assert both[0] == alone
