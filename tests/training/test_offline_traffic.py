"""Quiet driving through traffic as lessons: what is kept of it, and what braking there is said to cost."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from support.recordings import YAML, made_up, order

from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.recording import record as record_trace
from lgmd_gym.cli import main as cli
from lgmd_gym.envs.traffic.emergencies import Emergencies
from lgmd_gym.training.config import Order
from lgmd_gym.training.offline import traffic
from lgmd_gym.training.offline.episodes import Moments, record
from lgmd_gym.training.offline.splits import check_drives, drives_of, lots
from lgmd_gym.training.offline.storage import load, origin_of, save
from lgmd_gym.training.offline.traffic import cuts, quiet_drive, record_traffic

HIGHWAY, INTERSECTION = 0, 3  # seeds, and kinds: they take turns
SHORT = {"duration": 12}


@pytest.fixture
def short(monkeypatch):
    """Drives of 12 s instead of 60."""
    monkeypatch.setattr(traffic, "make_traffic", partial(traffic.make_traffic, config=SHORT))


@pytest.mark.parametrize(("env_id", "speed"), [("LGMD/EmptyRoad-v0", 12.0), ("LGMD/Following-v0", 20.0)])
def test_braking_costs_what_the_scenarios_say(tmp_path, env_id, speed):
    """Against replays in `BrakingEnv`, which the prices are for."""
    plan = order(tmp_path, env_id=env_id, env_kwargs={"ego_speed": speed}).plan()
    (driven,) = record(plan, "train", range(1), 1, lambda count: None)
    priced = quiet_drive(driven.seen, None, 30.0)
    assert not driven.threat
    assert driven.seen["ego_speed"] == pytest.approx(speed)
    assert priced.rewards == pytest.approx(driven.rewards, abs=1e-3)
    # jerk, 0.05 at the start and at the standstill each, is left out
    assert priced.returns[:-30] == pytest.approx(driven.returns[:-30], abs=0.2)


def test_prices_at_a_standstill_and_at_the_end():
    standing = quiet_drive({"ego_speed": np.zeros((60, 1), np.float32)}, None, 30.0)
    assert not standing.rewards.any()
    assert not standing.returns.any()
    last = quiet_drive({"ego_speed": np.full((60, 1), 20.0, np.float32)}, None, 30.0)
    assert last.returns[-1] == pytest.approx(last.rewards[-1])  # the brake has not answered yet
    # with 1 s left: 0.233 s until the brake bites, 0.767 s of it at 9 m/s², two a second, on 17.36 m of 20
    assert last.returns[-30] == pytest.approx(17.355 / 20.0 - 2.0 * 0.7667, abs=1e-3)


def test_pieces_are_even_and_lose_nothing():
    assert cuts([True] * 29, 30.0) == []
    assert cuts([True] * 300, 30.0) == [(0, 300)]
    assert cuts([True] * 301, 30.0) == [(0, 150), (150, 301)]
    stretches = [True] * 40 + [False] * 5 + [True] * 20 + [False] + [True] * 601
    assert cuts(stretches, 30.0) == [(0, 40), (66, 266), (266, 467), (467, 667)]


@pytest.mark.parametrize(
    ("emergencies", "kept"),
    [
        (Emergencies(None, ()), [0.0, 10.0, 20.0]),
        (Emergencies(41.0, ()), [0.0, 10.0, 20.0]),  # more than 10 s after the end
        (Emergencies(39.0, ()), [0.0, 9.67, 19.33]),
        (Emergencies(None, (15.0, 15.1)), [0.0, 15.13, 22.57]),
        (Emergencies(None, (5.0, 25.0)), [5.03, 25.03]),
    ],
)
def test_what_is_near_an_emergency_is_left_out(tmp_path, monkeypatch, emergencies, kept):
    plan = order(tmp_path).plan()

    def driven(plan, env, seed):
        moments = Moments(plan)
        for number in range(900):
            names = ("spike_frequency", "membrane_potential", "ffi", "ego_speed", "ego_yaw_rate")
            moments.add({name: np.array([number / 30.0], np.float32) for name in names})
        return moments, emergencies

    monkeypatch.setattr(traffic, "_driven", driven)
    (pieces,) = record_traffic(plan, "train", range(1), 1, lambda count: None)
    starts = [float(piece.seen["ego_speed"][0, 0]) for piece in pieces]
    assert starts == pytest.approx(kept, abs=0.01)
    for piece in pieces:
        for time in piece.seen["ego_speed"][:, 0]:
            assert emergencies.need(float(round(time * 30) / 30)) is None


@pytest.mark.parametrize("seed", [HIGHWAY, INTERSECTION])
def test_it_sees_what_the_suite_would_show(tmp_path, monkeypatch, short, seed):
    monkeypatch.setattr(traffic, "draw_view", lambda *_: {"condition": "fog"})
    monkeypatch.setattr(traffic, "cuts", lambda quiet, policy_hz: [(0, len(quiet))])
    told = []
    (pieces,) = record_traffic(order(tmp_path).plan(), "train", range(seed, seed + 1), 1, told.append)
    trace = record_trace(list(traffic.KINDS)[seed], seed, SensorConfig(camera="fovea").under("fog"), SHORT)
    assert told == [1]
    (whole,) = pieces
    assert len(whole) == len(trace.seen) - 1  # nothing is decided in the last one
    for name, array in whole.seen.items():
        assert np.array_equal(array, np.stack([item.observation[name] for item in trace.seen[:-1]]))


def test_emergencies_are_those_of_the_suite(tmp_path):
    """In a drive with some before its end and some after it."""
    kind, seed, config = list(traffic.KINDS)[INTERSECTION], INTERSECTION, {"duration": 8}
    trace = record_trace(kind, seed, SensorConfig(camera="fovea"), config)
    assert min(trace.emergencies.hard) < 8.0 < max(trace.emergencies.hard)
    env = traffic.make_traffic(kind, camera="fovea", config=config)
    _, found = traffic._driven(order(tmp_path).plan(), env, seed)
    assert found == trace.emergencies


@pytest.mark.slow
def test_a_training_with_traffic_and_another_with_its_drives(tmp_path, monkeypatch, short):
    file = tmp_path / "hyper.yml"
    file.write_text(YAML)
    common = ["train", "--algo", "recorded", "--camera", "fovea", "--hyperparams", str(file), "--jobs", "1"]
    common += ["--eval-episodes", "3", "--steps", "3", "--traffic", "2"]
    first, second = tmp_path / "first", tmp_path / "second"
    monkeypatch.setattr(traffic, "PIECE", 5.0)
    assert cli.run([*common, "--out", str(first)]) == 0
    kept = {lot: load(first / "drives" / lot / "000000.npz")[0] for lot in ("traffic-train", "train")}
    assert list(map(len, kept["train"])) == [1, 1, 1]
    assert len(kept["traffic-train"]) == 2
    pieces = [piece for some in kept["traffic-train"] for piece in some]
    assert len(pieces) > 2
    assert not any(piece.threat for piece in pieces)
    monkeypatch.setattr("lgmd_gym.training.offline.splits.record_traffic", None)  # nothing is recorded anew
    fewer = [*common[:-1], "1", "--drives", str(first)]
    assert cli.run([*fewer, "--out", str(second)]) == 0
    heads = (second / "log" / "progress.csv").read_text().splitlines()[0].split(",")
    assert set(heads) == {"train", "ret", "avoided", "false", "traffic", "best"}
    plan = order(tmp_path, steps=3, traffic=1, drives=first).plan()
    assert len(drives_of(plan, "train", tmp_path, False, 1)) == 3 + len(kept["traffic-train"][0])


def test_traffic_of_another_training_is_enough_or_refused(tmp_path):
    plan = order(tmp_path, drives=tmp_path, traffic=9, eval_episodes=1, steps=1).plan()
    wanted = [*lots(plan, "train"), *lots(plan, "validation")]
    assert [lot.name for lot in wanted] == ["train", "traffic-train", "validation", "traffic-validation"]
    assert [len(lot.seeds) for lot in wanted] == [1, 9, 1, 3]
    assert not set(wanted[1].seeds) & set(wanted[3].seeds)
    assert min(*wanted[1].seeds, *wanted[3].seeds) >= 10_000  # reports count from 0
    for lot in wanted[0], wanted[2]:
        (tmp_path / "drives" / lot.name).mkdir(parents=True)
        save([[made_up()]], tmp_path / "drives" / lot.name / "0.npz", origin_of(plan))
    with pytest.raises(ValueError, match="train once with --algo recorded --traffic 9, without --drives"):
        check_drives(plan)
    for lot in wanted[1], wanted[3]:
        (tmp_path / "drives" / lot.name).mkdir(parents=True)
        save([[], [made_up(), made_up()], []], tmp_path / "drives" / lot.name / "0.npz", origin_of(plan))
    with pytest.raises(ValueError, match=r"traffic-train' holds 3 drives, 9 are wanted; ask for fewer"):
        check_drives(plan)
    check_drives(replace(plan, traffic=3))


def test_who_drives_himself_takes_no_recorded_traffic():
    with pytest.raises(ValueError, match="only algo 'recorded' learns from traffic; leave it out with 'dqn'"):
        Order("dqn", demands=(0.0, -1.0), traffic=3)
    with pytest.raises(ValueError, match="traffic must be a whole number >= 0, got -1"):
        Order("recorded", traffic=-1)
