"""The traffic suite: recordings, forks, replays, false activations and runs."""

import csv
import json
import os
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from rich.console import Console
from support.runs import interrupt, new_run, read_rows, sorted_rows
from support.traffic import Recorded

from lgmd_gym.agents import AGENTS, BRAKE, HOLD, Agent, make_agent, to_action
from lgmd_gym.agents.rule import excitation
from lgmd_gym.agents.stopping_zone import StoppingZone
from lgmd_gym.benchmark.episode import Step, rollout
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.batch import Drive, TrafficTask, run_traffic_task
from lgmd_gym.benchmark.traffic.observer import Observer
from lgmd_gym.benchmark.traffic.recording import fork, look_ahead, record_traffic
from lgmd_gym.benchmark.traffic.replay import RESEED, LiveEpisode
from lgmd_gym.benchmark.traffic.rows import KEYS, BrakingEvent, measure
from lgmd_gym.benchmark.traffic.schedule import CameraSchedule
from lgmd_gym.benchmark.traffic.summary import COLUMNS, traffic_summaries, write_traffic_summary
from lgmd_gym.benchmark.traffic.tables import traffic_table
from lgmd_gym.envs.traffic.emergencies import Emergencies
from lgmd_gym.envs.traffic.registration import KINDS, register_traffic, traffic_id

SENSORS = SensorConfig()
SHORT = {"duration": 12}


class BrakeDuring(Agent):
    """Brakes in the given intervals [s], and not at all after a reset that follows a standstill."""

    name = "brake-during"

    def __init__(self, *intervals, level=BRAKE):
        super().__init__()
        self.intervals, self.level, self.reset_seeds = intervals, level, []

    def reset(self, seed=None):
        super().reset(seed)
        self.decision = 0
        self.reset_seeds.append(seed)

    def demand(self, observation, info):
        time = self.decision / 30
        self.decision += 1
        brakes = any(start <= time < end for start, end in self.intervals)
        return self.level if brakes and len(self.reset_seeds) == 1 else HOLD


def without_trace(info):
    """Return the values of `info` that can be compared with ==."""
    return {key: value for key, value in info.items() if key != "lgmd/trace"}


@pytest.fixture(scope="module")
def merge():
    return Recorded("merge", config=SHORT)


@pytest.fixture
def wall_kinds(monkeypatch):
    """Registers an empty road as "empty" and one with a stationary car 50 m ahead as "wall"."""
    monkeypatch.setitem(KINDS, "empty", "support.traffic:EmptyHighway")
    monkeypatch.setitem(KINDS, "wall", "support.traffic:BlockedHighway")
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
    look_ahead(env, 2.0, 1.0)
    assert (env.ego.position.tolist(), env.steps) == before
    assert braked["ego_speed"] < env.ego.speed
    for _ in range(20):
        env.step(to_action(HOLD))
    assert env.ego.speed == merge.recording.moments[80].speed


def test_fork_that_differs_from_the_recording_is_rejected(merge):
    moments = list(merge.recording.moments)
    moments[9] = moments[10]
    with pytest.raises(RuntimeError, match="merge traffic, seed 0 does not repeat at decision 9"):
        replace(merge.recording, moments=tuple(moments)).fork(9)


@pytest.mark.parametrize("camera", ["fovea", ["wide", "tele"], "birdseye"])
def test_recorded_steps_equal_those_of_the_wrapper(camera):
    config = {"duration": 3}
    recorded = Recorded("two-way", 1, SensorConfig(camera), config)
    env = gym.make(traffic_id("two-way"), camera=camera, trace=True, config=config)
    steps = [step for step, _ in rollout(env, make_agent("no-brake"), 1)]
    assert len(steps) == len(recorded.steps) == 3 * 30 + 1
    assert all(same_inputs(step, other) for step, other in zip(recorded.steps, steps, strict=True))
    assert [step.done for step in recorded.steps] == [step.done for step in steps]


@pytest.mark.parametrize("decision", [0, 45])
def test_live_episode_continues_a_recording(merge, decision):
    live = LiveEpisode(merge.recording, decision, merge.sensor_config)
    for later in range(decision + 1, decision + 20):
        assert same_inputs(live.step(HOLD), merge.steps[later])


def test_live_episode_observes_the_same_as_the_wrapper_while_braking(merge):
    live = LiveEpisode(merge.recording, 0, merge.sensor_config)
    env = gym.make(traffic_id("merge"), camera="fovea", trace=True, config=SHORT)
    env.reset(seed=0)
    for _ in range(40):
        observation, _, terminated, truncated, info = env.step(to_action(BRAKE))
        assert same_inputs(live.step(BRAKE), Step(observation, info, 0.0, terminated or truncated))


def scheduled_steps(kind, seed, agent, config):
    """Return the recording, the schedule and the steps of an agent whose unread cameras are not drawn."""
    observer = Observer(SENSORS.for_agent(agent))
    recording = record_traffic(kind, seed, observer.sensors, 0, observer.fps, config)
    schedule = CameraSchedule(recording.moments, [agent], len(observer.sensors.names))
    observer.play_first_pass([recording.moments], [schedule])
    schedule.plan_second_pass()
    steps = [
        observer.observe([moment], [schedule], decision)[0]
        for decision, moment in enumerate(recording.moments)
    ]
    return recording, schedule, steps


def potentials(steps):
    return np.array([step.info["lgmd/trace"][0].response.membrane_potential for step in steps])


def motion(recording):
    """Return speed and yaw rate at every decision."""
    speed = np.array([moment.speed for moment in recording.moments])
    return speed, np.array([moment.yaw_rate for moment in recording.moments], np.float32)


@pytest.mark.parametrize(("kind", "seed"), [("two-way", 1), ("intersection", 1)])
def test_readings_of_warmed_up_neurons_equal_those_with_all_cameras(kind, seed):
    agent, config = make_agent("stopping-zone"), {"duration": 14}
    recording, schedule, steps = scheduled_steps(kind, seed, agent, config)
    every = Recorded(kind, seed, SENSORS.for_agent(agent), config).steps
    expected, found = excitation(potentials(every)), excitation(potentials(steps))
    read = agent.cameras_in_use(*motion(recording), potentials(every))
    drawn = np.mean(schedule.first | schedule.second)
    assert 0.05 < np.mean(read) <= drawn < 0.6
    assert np.abs(found - expected)[read].max() < 1e-4


def test_rows_of_a_batch_equal_those_of_single_drives():
    agents = ("stopping-zone", "spike-threshold")
    drives = (Drive("merge", 1, agents[:1]), Drive("intersection", 1, agents))
    batch = run_traffic_task(TrafficTask(drives, SENSORS))
    single = [
        run_traffic_task(TrafficTask((replace(drive, agents=(agent,)),), SENSORS))[0]
        for drive in drives
        for agent in drive.agents
    ]
    assert [row["error"] for row in batch] == [None] * 3
    assert batch == single
    assert batch[-1]["brakes"] > 0


@pytest.mark.parametrize("kind", ["wall", *(pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS)])
def test_cameras_that_are_not_read_do_not_change_the_row(monkeypatch, wall_kinds, kind):
    """The rule brakes for the stationary car of "wall"."""
    task = TrafficTask((Drive(kind, 0, ("stopping-zone",)),), SENSORS)
    (scheduled,) = run_traffic_task(task)
    monkeypatch.setattr(StoppingZone, "cameras_in_use", lambda *arguments: None)
    assert run_traffic_task(task) == [scheduled]
    assert (scheduled["brakes"] > 0) == (kind == "wall")


def test_failure_in_one_drive_leaves_the_others(monkeypatch, wall_kinds):
    monkeypatch.setitem(KINDS, "empty", "support.traffic:Missing")
    drives = (Drive("empty", 0, ("no-brake",)), Drive("wall", 0, ("no-brake",)))
    failed, played = run_traffic_task(TrafficTask(drives, SENSORS))
    assert "Missing" in failed["error"]
    assert played["error"] is None
    assert played["collision"]


def test_braking_for_a_stationary_car_is_necessary_and_avoids_contact(wall_kinds):
    log, row = play("wall", BrakeDuring((0.0, 6.0)))
    assert row["threat"]
    assert row["avoided"] is True
    assert not row["collision"]
    assert (row["brakes"], row["false_activations"], row["premature_brakes"], row["stops"]) == (1, 0, 0, 1)
    assert log.events[0].time_to_emergency < 1.0  # hard braking of the driver
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
    emergencies = Emergencies(contact=20.0, hard=(5.0, 5.1))
    assert emergencies.time_until(0.0) == 5.0
    assert emergencies.time_until(5.0) == 0.0
    assert emergencies.time_until(5.2) is None
    assert emergencies.time_until(10.0) == 10.0
    assert emergencies.time_until(9.9) is None
    assert Emergencies(None, ()).time_until(0.0) is None


def test_braking_4_5_s_before_an_emergency_is_premature_not_false():
    event = BrakingEvent(start=0.0, time_to_emergency=4.5, last=0.0, peak=9.0)
    assert (event.false, event.premature) == (False, True)


def row(agent="a", kind="merge", **values):
    """Return a row with zeros for all counts and lengths."""
    identity = {"agent": agent, "case": f"traffic/{kind}/s0", "condition": "clear"}
    counts = ("alerts", "brakes", "false_activations", "premature_brakes", "stops")
    zeros = dict.fromkeys((*counts, "peak_deceleration", "distance"), 0)
    return dict.fromkeys(KEYS) | identity | zeros | {"collision": False, "threat": False} | values


@pytest.fixture
def summary_rows():
    return [
        row(distance=150_000.0, brakes=3, false_activations=1, alerts=6),
        row(distance=150_000.0, kind="highway", threat=True, avoided=True),
        row(agent="b", distance=100_000.0, collision=True, side="rear"),
        row(agent="b", error="Traceback"),
    ]


def test_summary_adds_up_the_episodes_of_an_agent(summary_rows):
    a, b = traffic_summaries(summary_rows)
    assert (a.distance, a.drives, a.false_activations, a.brakes) == (300_000.0, 2, 1, 3)
    assert a.per_100km(a.false_activations) == pytest.approx(1 / 3)
    assert a.interval == (pytest.approx(0.0253 / 3, abs=1e-4), pytest.approx(5.572 / 3, abs=1e-3))
    assert (a.avoided.k, a.avoided.n) == (1, 1)
    assert (b.contacts, b.rear_ended, b.errors, b.drives) == (1, 1, 1, 1)
    kinds = [(item.agent, item.kind) for item in traffic_summaries(summary_rows, by_kind=True)]
    assert kinds == [("a", "highway"), ("a", "merge"), ("b", "merge")]


def test_summary_file_has_one_line_per_agent_and_kind(summary_rows, tmp_path):
    write_traffic_summary(summary_rows, tmp_path / "summary.csv")
    with (tmp_path / "summary.csv").open() as file:
        header, *lines = csv.reader(file)
    assert tuple(header) == COLUMNS
    assert [tuple(line[:3]) for line in lines] == [
        ("a", "clear", "all"),
        ("b", "clear", "all"),
        ("a", "clear", "highway"),
        ("a", "clear", "merge"),
        ("b", "clear", "merge"),
    ]
    values = dict(zip(header, lines[0], strict=True))
    assert (values["distance_km"], values["false_per_100km"]) == ("300.0000", "0.3333")


def test_table_shows_rates_with_intervals(summary_rows):
    console = Console(width=120, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(traffic_table(summary_rows, ["a", "b"], "title"))
    text = console.export_text()
    assert "0.3 [0.0–1.9]" in text
    assert "b (1 errors)" in text
    assert "[exact" in text


def test_upper_bound_of_no_false_activation_in_300_km():
    (item,) = traffic_summaries([row(distance=300_000.0)])
    assert item.interval == (0.0, pytest.approx(1.2296, abs=1e-4))


def test_run_writes_rows_as_they_finish(tmp_path, monkeypatch):
    class Faulty(Agent):
        def demand(self, observation, info):
            raise RuntimeError("internal failure")

    monkeypatch.setitem(AGENTS, "faulty", Faulty)
    values = {"agents": ["no-brake", "faulty", "no-brake"], "conditions": ["clear", "fog"], "seeds": 1}
    run = new_run(tmp_path / "run", suite="traffic", kinds=["intersection"], **values)
    assert run.total == 4
    reported = []
    assert run.play(reported.append)
    assert read_rows(tmp_path / "run") == reported == run.rows
    assert all(tuple(item) == KEYS for item in reported)
    assert [(item["agent"], item["condition"]) for item in reported] == [
        ("no-brake", "clear"),
        ("faulty", "clear"),
        ("no-brake", "fog"),
        ("faulty", "fog"),
    ]
    assert all("internal failure" in item["error"] for item in reported if item["agent"] == "faulty")
    assert all(item["error"] is None and item["distance"] > 50.0 for item in reported[::2])
    assert json.loads((tmp_path / "run" / "run.json").read_text())["complete"] is True


def test_interrupted_run_is_resumed_with_the_missing_episodes(tmp_path):
    kinds = ["merge", "intersection"]
    first = new_run(tmp_path / "run", suite="traffic", kinds=kinds, agents=["no-brake"], seeds=1)
    assert not first.play(interrupt)
    assert [item["case"] for item in first.rows] == ["traffic/merge/s0"]
    run = Run.resume(tmp_path / "run")
    played = []
    assert run.play(played.append)
    assert [item["case"] for item in played] == ["traffic/intersection/s0"]
    assert [item["case"] for item in run.rows] == ["traffic/merge/s0", "traffic/intersection/s0"]


@pytest.mark.slow
def test_number_of_processes_does_not_change_the_rows(tmp_path):
    values = {"suite": "traffic", "kinds": ["merge", "intersection"], "seeds": 2}
    agents = ["spike-threshold", "random-brake"]
    rows = []
    for jobs in (1, 2):
        run = new_run(tmp_path / str(jobs), jobs, agents=agents, **values)
        assert run.play()
        rows.append(sorted_rows(run.rows))
    assert rows[0] == rows[1]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"agents": ["spike-treshold"]}, "did you mean 'spike-threshold'"),
        ({"kinds": ["merg"]}, "did you mean 'merge'"),
        ({"kinds": []}, "kinds must contain at least one name, got none"),
        ({"camera": "foeva"}, "foeva"),
    ],
)
def test_invalid_configuration_is_rejected_before_the_folder_is_created(tmp_path, values, message):
    with pytest.raises(ValueError, match=message):
        new_run(tmp_path / "run", **{"suite": "traffic", "agents": ["no-brake"], "seeds": 1} | values)
    assert list(tmp_path.iterdir()) == []
