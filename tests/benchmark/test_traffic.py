"""The traffic suite: recordings, forks, what makes a brake false, intervals, runs."""

import csv
import json
import os
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from support.traffic import NearWall, Wall

import lgmd_gym.agents as agents_room
from lgmd_gym.agents import BRAKE, HOLD, Agent, make_agent, to_action
from lgmd_gym.benchmark.episode import SensorConfig
from lgmd_gym.benchmark.runs import resume_run
from lgmd_gym.benchmark.traffic.recording import fork, look_ahead, record
from lgmd_gym.benchmark.traffic.replay import RESEED, Ride
from lgmd_gym.benchmark.traffic.rows import KEYS, Braking, make_row
from lgmd_gym.benchmark.traffic.run import TrafficRun, run_traffic
from lgmd_gym.benchmark.traffic.summary import poisson_interval, traffic_scores
from lgmd_gym.benchmark.traffic.tables import COLUMNS, traffic_table, write_traffic_summary
from lgmd_gym.envs.traffic.emergencies import Emergencies
from lgmd_gym.envs.traffic.registration import KINDS

EYES = SensorConfig()
SHORT = {"duration": 12}


class During(Agent):
    """Brakes in the given stretches of time [s], until it is reset after a standstill."""

    name = "during"

    def __init__(self, *stretches, level=BRAKE):
        super().__init__()
        self.stretches, self.level, self.resets = stretches, level, []

    def reset(self, seed=None):
        super().reset(seed)
        self.decision = 0
        self.resets.append(seed)

    def demand(self, observation, info):
        time = self.decision / 30
        self.decision += 1
        return (
            self.level
            if len(self.resets) == 1 and any(start <= time < end for start, end in self.stretches)
            else HOLD
        )


class Watching(Agent):
    """Never brakes, and keeps what it has seen."""

    def __init__(self):
        super().__init__()
        self.seen = []

    def demand(self, observation, info):
        truth = {key: value for key, value in info.items() if key != "lgmd/trace"}
        self.seen.append(({key: value.tolist() for key, value in observation.items()}, truth))
        return HOLD


@pytest.fixture(scope="module")
def merge():
    return record("merge", 0, EYES, SHORT)


@pytest.fixture
def kinds(monkeypatch):
    monkeypatch.setitem(KINDS, "empty", Wall)
    monkeypatch.setitem(KINDS, "wall", NearWall)


def play(kind, agent, seconds=12):
    trace = record(kind, 0, EYES, {"duration": seconds})
    log = Ride(trace, agent).play()
    return log, make_row("during", trace, log)


def test_a_fork_goes_on_bit_for_bit(merge):
    """Forks of kept and of repeated states alike, whatever was looked at with the cameras in between."""
    for decision in (0, 37, 300, 313):
        env = merge.fork(decision)
        for later in range(decision + 1, decision + 40):
            observation, *_, info = env.step(to_action(HOLD))
            recorded = merge.seen[later]
            assert all(np.array_equal(observation[key], recorded.observation[key]) for key in observation)
            told = {key: value for key, value in info.items() if key != "lgmd/trace"}
            assert told == {key: value for key, value in recorded.info.items() if key != "lgmd/trace"}


def test_forks_go_their_own_ways(merge):
    env = merge.fork(60)
    other = fork(env)
    before = env.unwrapped.ego.position.tolist(), env.unwrapped.steps
    for _ in range(20):
        braked = other.step(to_action(BRAKE))[4]
    look_ahead(env, 2.0, 1.0)
    assert (env.unwrapped.ego.position.tolist(), env.unwrapped.steps) == before
    assert braked["ego_speed"] < env.unwrapped.ego.speed
    for _ in range(20):
        observation = env.step(to_action(HOLD))[0]
    assert observation["ego_speed"] == merge.seen[80].observation["ego_speed"]


def test_a_fork_that_does_not_repeat_is_no_fork(merge):
    seen = list(merge.seen)
    seen[9] = seen[10]
    with pytest.raises(RuntimeError, match="merge traffic, seed 0 does not repeat at decision 9"):
        replace(merge, seen=tuple(seen)).fork(9)


def test_the_recording_shows_what_a_live_drive_shows():
    trace = record("two-way", 1, EYES, {"duration": 6})
    shown, live = Watching(), Watching()
    logs = [Ride(trace, shown).play(), Ride(trace, live, live=True).play()]
    assert shown.seen == live.seen
    assert len(shown.seen) == len(trace.seen) == 6 * 30 + 1
    assert make_row("a", trace, logs[0]) == make_row("a", trace, logs[1])


@pytest.mark.slow
@pytest.mark.parametrize("kind", list(KINDS))
@pytest.mark.parametrize("agent", ["no-brake", "spike-threshold"])
def test_recorded_and_live_drives_give_the_same_row(kind, agent):
    for seed in range(2):
        trace = record(kind, seed, EYES)
        rows = [make_row("a", trace, Ride(trace, make_agent(agent), live).play()) for live in (False, True)]
        assert rows[0] == rows[1]


def test_braking_for_a_wall_is_needed_and_avoids_it(kinds):
    log, row = play("wall", During((0.0, 6.0)))
    assert row["threat"]
    assert row["avoided"] is True
    assert not row["collision"]
    assert (row["brakes"], row["false_activations"], row["premature_brakes"], row["stops"]) == (1, 0, 0, 1)
    assert log.brakings[0].need < 1.0  # the driver's own hard braking
    assert 2.0 < row["peak_deceleration"] <= 9.0


def test_braking_too_late_for_a_wall_ends_the_drive_there(kinds):
    _, row = play("wall", During((2.4, 6.0)))
    assert row["collision"]
    assert row["avoided"] is False
    assert row["side"] == "front"
    assert 0.0 < row["impact_speed"] < 25.0


def test_braking_on_an_empty_road_is_false_and_the_drive_goes_on(kinds):
    agent = During((1.0, 2.0), (3.5, 9.0))
    log, row = play("empty", agent, 20)
    assert not row["threat"]
    assert row["avoided"] is None
    assert (row["brakes"], row["false_activations"], row["stops"]) == (2, 2, 1)
    assert row["peak_deceleration"] == pytest.approx(9.0)
    assert [braking.need for braking in log.brakings] == [None, None]
    assert agent.resets == [0, RESEED]
    assert log.end.info["ego_speed"] > 10.0
    assert row["duration"] == 20.0
    assert json.loads(json.dumps(row, allow_nan=False)) == row
    assert tuple(row) == KEYS


@pytest.mark.parametrize(("level", "felt"), [(-0.2, 0), (-0.4, 1)])
def test_only_what_is_felt_counts(kinds, level, felt):
    """1.8 and 3.6 m/s² against a quarter g."""
    _, row = play("empty", During((1.0, 2.0), level=level), 5)
    assert row["brakes"] == row["false_activations"] == felt
    assert row["peak_deceleration"] == pytest.approx(-9.0 * level, abs=0.02)


def test_demands_close_to_each_other_are_one_brake(kinds):
    _, row = play("empty", During((1.0, 1.3), (1.6, 1.9), (2.5, 2.8)), 6)
    assert row["brakes"] == 1


def test_always_braking_still_drives():
    trace = record("two-way", 0, EYES, {"duration": 16})
    row = make_row("always-brake", trace, Ride(trace, make_agent("always-brake")).play())
    assert row["brakes"] >= 3
    assert row["brakes"] - row["stops"] in (0, 1)
    assert row["distance"] > 40.0


def test_need_is_the_next_emergency_within_the_horizon():
    seen = Emergencies(contact=20.0, hard=(5.0, 5.1))
    assert seen.need(0.0) == 5.0
    assert seen.need(5.0) == 0.0
    assert seen.need(5.2) is None
    assert seen.need(10.0) == 10.0
    assert seen.need(9.9) is None
    assert Emergencies(None, ()).need(0.0) is None
    late = Braking(start=0.0, need=4.5, last=0.0, peak=9.0)
    assert (late.false, late.premature) == (False, True)


@pytest.mark.parametrize(
    ("count", "low", "high"),
    [(0, 0.0, 3.689), (1, 0.0253, 5.572), (5, 1.623, 11.668), (10, 4.795, 18.390), (100, 81.364, 121.627)],
)
def test_poisson_interval_is_garwoods(count, low, high):
    assert poisson_interval(count) == (pytest.approx(low, abs=6e-4), pytest.approx(high, abs=6e-4))


def test_poisson_interval_of_many_is_nearly_normal_and_the_input_is_checked():
    low, high = poisson_interval(10_000)
    assert (low, high) == (pytest.approx(10_000 - 195, abs=2), pytest.approx(10_000 + 198, abs=2))
    assert poisson_interval(0, confidence=0.9)[1] == pytest.approx(-np.log(0.05))  # 0.95 one-sided
    for bad in ((-1, 0.95), (3, 1.0)):
        with pytest.raises(ValueError, match="count must be >= 0"):
            poisson_interval(*bad)


def row(agent="a", kind="merge", **values):
    row = dict.fromkeys(KEYS) | {
        "agent": agent,
        "case": f"traffic/{kind}/s0",
        "collision": False,
        "threat": False,
    }
    numbers = (
        "alerts",
        "brakes",
        "false_activations",
        "premature_brakes",
        "stops",
        "peak_deceleration",
        "distance",
    )
    return row | dict.fromkeys(numbers, 0) | values


def test_scores_add_up(tmp_path):
    rows = [
        row(distance=150_000.0, brakes=3, false_activations=1, alerts=6),
        row(distance=150_000.0, kind="highway", threat=True, avoided=True),
        row(agent="b", distance=100_000.0, collision=True, side="rear"),
        row(agent="b", error="Traceback"),
    ]
    a, b = traffic_scores(rows)
    assert (a.distance, a.drives, a.false_activations, a.brakes) == (300_000.0, 2, 1, 3)
    assert a.per_100km(a.false_activations) == pytest.approx(1 / 3)
    assert a.interval == (pytest.approx(0.0253 / 3, abs=1e-4), pytest.approx(5.572 / 3, abs=1e-3))
    assert (a.avoided.k, a.avoided.n) == (1, 1)
    assert (b.contacts, b.rear_ended, b.errors, b.drives) == (1, 1, 1, 1)
    assert [score.kind for score in traffic_scores(rows, by_kind=True)] == ["merge", "highway", "merge"]
    write_traffic_summary(rows, tmp_path / "summary.csv")
    table = list(csv.reader((tmp_path / "summary.csv").open()))
    assert tuple(table[0]) == COLUMNS
    assert all(len(line) == len(COLUMNS) for line in table)
    console = Console(width=120, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(traffic_table(rows, ["a", "b"], "title"))
    text = console.export_text()
    assert "0.3 [0.0–1.9]" in text
    assert "b (1 errors)" in text
    assert "[exact" in text


def test_zero_in_300_km_still_allows_one_in_a_hundred():
    score = traffic_scores([row(distance=300_000.0)])[0]
    assert score.interval == (0.0, pytest.approx(1.2296, abs=1e-4))


def test_a_run_streams_rows_and_keeps_them(tmp_path, monkeypatch):
    class Broken(Agent):
        def demand(self, observation, info):
            raise RuntimeError("no idea")

    monkeypatch.setitem(agents_room.AGENTS, "broken", Broken)
    run = TrafficRun(["no-brake", "broken", "no-brake"], ["intersection"], 2, 1, tmp_path / "run", EYES)
    assert run.total == 4
    told = []
    assert run.play(told.append)
    lines = (tmp_path / "run" / "episodes.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in lines] == told == run.rows
    assert [(item["agent"], item["seed"]) for item in told] == [
        ("no-brake", 0),
        ("broken", 0),
        ("no-brake", 1),
        ("broken", 1),
    ]
    assert all("no idea" in item["error"] for item in told if item["agent"] == "broken")
    assert all(item["error"] is None and item["distance"] > 50.0 for item in told[::2])
    assert json.loads((tmp_path / "run" / "run.json").read_text())["complete"] is True


def test_a_run_that_was_broken_off_is_played_to_its_end(tmp_path):
    def stop(item):
        raise KeyboardInterrupt

    broken = TrafficRun(["no-brake"], ["merge", "intersection"], 1, 1, tmp_path / "run", EYES)
    assert not broken.play(stop)
    assert [item["case"] for item in broken.rows] == ["traffic/merge/s0"]
    run = resume_run(tmp_path / "run", 1)
    told = []
    assert run.play(told.append)
    assert [item["case"] for item in told] == ["traffic/intersection/s0"]
    assert [item["case"] for item in run.rows] == ["traffic/merge/s0", "traffic/intersection/s0"]


@pytest.mark.slow
def test_jobs_change_nothing():
    def rows(jobs):
        given = run_traffic(["spike-threshold", "random-brake"], ["merge", "intersection"], range(2), jobs)
        return sorted(given, key=lambda item: (item["case"], item["agent"]))

    assert rows(1) == rows(2)


def test_bad_input_is_refused_before_anything_is_played(tmp_path):
    for arguments, message in (
        ((["spike-treshold"], ["merge"], 1, 1), "did you mean 'spike-threshold'"),
        ((["no-brake"], ["merg"], 1, 1), "did you mean 'merge'"),
        (([], ["merge"], 1, 1), "agents needs at least one"),
        ((["no-brake"], [], 1, 1), "kinds needs at least one"),
        ((["no-brake"], ["merge"], 1, -1), "jobs must be >= 1, got -1"),
    ):
        agents, kinds, seeds, jobs = arguments
        with pytest.raises(ValueError, match=message):
            run_traffic(agents, kinds, range(seeds), jobs)
        with pytest.raises(ValueError, match=message):
            TrafficRun(*arguments, tmp_path / "run")
    with pytest.raises(ValueError, match="foeva"):
        run_traffic(["no-brake"], ["merge"], [0], 1, SensorConfig(camera="foeva"))
    with pytest.raises(ValueError, match="seeds needs at least one"):
        run_traffic(["no-brake"], ["merge"], [], 1)
    with pytest.raises(ValueError, match="seeds must be a whole number >= 1, got 0"):
        TrafficRun(["no-brake"], ["merge"], 0, 1, tmp_path / "run")
    assert not (tmp_path / "run").exists()
