"""The script docs/examples/traffic_causes.py: what is in front of the ego at a false activation."""

from math import inf, pi
from types import SimpleNamespace

import numpy as np
import pytest
from support.examples import load

from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.stored_run import StoredRun
from lgmd_gym.rendering.playback import make_target


def vehicle(x, y, heading=0.0, speed=5.0):
    return SimpleNamespace(position=np.array([x, y]), heading=heading, speed=speed)


def test_situations():
    """The first description that applies counts, in the frame of an ego that heads along +y."""
    situation_of, ego = load("traffic_causes").situation_of, vehicle(0.0, 0.0, pi / 2)
    ahead, beside = vehicle(1.0, 20.0, pi / 2), vehicle(3.0, 4.0, pi / 2)
    crossing, oncoming = vehicle(-6.0, 8.0), vehicle(0.0, 10.0, -pi / 2 - 0.5)
    behind, far = vehicle(0.0, -5.0, pi / 2), vehicle(0.0, 31.0, pi / 2)
    everything = [ego, oncoming, crossing, beside, ahead, behind, far]
    assert situation_of(ego, everything) == ("car ahead", pytest.approx(np.hypot(1.0, 20.0)))
    assert situation_of(ego, [vehicle(0.5, 12.0, pi)]) == ("crossing", pytest.approx(np.hypot(0.5, 12.0)))
    assert situation_of(ego, [oncoming, crossing, beside]) == ("crossing", pytest.approx(10.0))
    assert situation_of(ego, [beside, oncoming]) == ("oncoming", pytest.approx(10.0))
    assert situation_of(ego, [beside, behind]) == ("other", pytest.approx(5.0))
    assert situation_of(ego, [ego, behind, far]) == ("none", inf)


def test_the_event_begins_after_a_pause_in_the_drive_of_the_row(monkeypatch):
    """A light demand, a pause of two seconds, a demand interrupted for half a second, then full braking."""
    script, made, speeds = load("traffic_causes"), [], []
    demands = iter([-0.02] * 3 + [0.0] * 60 + [-0.02] + [0.0] * 15 + [-1.0] * 30)

    class Tapping:
        camera, neuron = "wide", None

        def reset(self, seed):
            assert seed == 4

        def act(self, observation, info):
            speeds.append(info["ego_speed"])
            return np.array([next(demands)])

    def make(target, arguments, **options):
        made.append((target, options["world"], options["condition"], options["road"]))
        return make_target(target, arguments, **options)

    monkeypatch.setattr(script, "make_agent", lambda name: Tapping())
    monkeypatch.setattr(script, "make_target", make)
    config = RunConfig(suite="traffic", agents=("no-brake",), seeds=5, conditions=("fog",), road="rough")
    row = {"case": "traffic/highway/s4", "seed": 4, "world": 8003, "condition": "fog"}
    onset = script.first_event(config, "tapping", row)
    assert made == [("traffic/highway", 8003, "fog", "rough")]
    assert onset.speed == speeds[63]  # the first decision after the pause


def test_the_first_event_of_each_drive():
    """`always-brake` brakes at once; drives with a braking event that is needed are left out."""
    script = load("traffic_causes")
    config = RunConfig(suite="traffic", agents=("always-brake",), seeds=2, worlds=0, conditions=("clear",))
    row = {"agent": "always-brake", "case": "traffic/two-way/s0", "seed": 0, "world": None, "error": None}
    row |= {"condition": "clear", "brakes": 2, "false_activations": 2}
    others = [row | {"false_activations": 1}, row | {"brakes": 0, "false_activations": 0}]
    run = StoredRun(config, [row, *others], False)
    ((kind, onset),) = script.play(run, "always-brake", 1)
    assert kind == "two-way"
    assert onset.situation in script.SITUATIONS
    assert onset.speed > 5.0
    head, _, line = script.table([(kind, onset), ("merge", onset)])
    assert head == "| in front of the ego | merge | two-way | all | ego speed [m/s] | distance [m] |"
    assert line.startswith(f"| {onset.situation} | 1 | 1 | 2 | {onset.speed:.1f} | ")
    with pytest.raises(RuntimeError, match="no-brake does not brake in traffic/two-way/s0"):
        script.first_event(config, "no-brake", row)
    with pytest.raises(ValueError, match="no drive in which all braking events of always-brake are false"):
        script.play(run._replace(rows=others), "always-brake", 1)
    with pytest.raises(ValueError, match="the run of traffic has no agent 'a'"):
        script.play(run, "a", 1)
    with pytest.raises(
        ValueError, match="the run is one of r152; pass one of lgmd-gym bench --suite traffic"
    ):
        script.play(
            run._replace(config=RunConfig(suite="r152", agents=("always-brake",), seeds=2)), "always-brake", 1
        )
