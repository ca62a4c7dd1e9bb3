"""`benefit_risk.py`: threats avoided against speed lost, per agent."""

from types import SimpleNamespace

import pytest
from support.examples import load
from support.rows import threat_row


def run(agents, rows, suite="everyday-threats"):
    return SimpleNamespace(config=SimpleNamespace(agents=agents, suite=suite), rows=rows)


def threats(agents, avoided):
    """Return a run with one threat per outcome, an FCW driver, and a level without a threat."""
    case = "everyday-threats/LowBox/v1"
    rows = [
        threat_row(agent, case, seed, world=seed, avoided=outcome, fcw_driver=False)
        for agent in agents
        for seed, outcome in enumerate(avoided)
    ]
    others = [threat_row(agents[0], case, 9, world=9, avoided=True, fcw_driver=True)]
    others += [threat_row(agents[0], case, 10, world=10, fcw_driver=False) | {"threat": False}]
    return run(agents, rows + others)


def traffic(lost):
    counts = dict.fromkeys(
        ("alerts", "brakes", "false_activations", "needless_activations", "moving_time", "needed_time"), 0
    )
    counts |= {
        "threat": False,
        "scaled_needed_time": 0.0,
        "peak_deceleration": 0.0,
        "collision": False,
        **{"caused": False, "side": None, "avoidable": None, "avoided_by_brake": None},
    }
    rows = [
        threat_row(agent, "traffic/merge", world=0, distance=50_000.0, speed_lost=value) | counts
        for agent, value in lost.items()
    ]
    return run(list(lost), rows, "traffic")


def test_points_are_the_shares_and_the_speed_lost_per_100_km():
    script = load("benefit_risk")
    points = script.points_of(
        threats(["policy:x", "bound", "policy:x:margin=1"], [True, True, False]),
        traffic({"policy:x:margin=1": 1.0, "policy:x": 3.5, "other": 0.0}),
    )
    assert [(point.agent, point.speed_lost) for point in points] == [
        ("policy:x", 7.0),
        ("policy:x:margin=1", 2.0),
    ]
    assert {(point.avoided.k, point.avoided.n) for point in points} == {(2, 3)}
    assert script.curves_of(points) == {"policy:x": points[::-1]}


def test_the_figure_is_written(monkeypatch, tmp_path, capsys):
    script = load("benefit_risk")
    runs = {"a": threats(["policy:x"], [True, False]), "b": traffic({"policy:x": 1.0})}
    monkeypatch.setattr(script, "read_run", lambda folder: runs[folder.name])
    script.main([str(tmp_path / "figure.png"), "a", "b"])
    assert (tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert "policy:x: 1/2, 2.0 m/s per 100 km" in capsys.readouterr().out


def test_runs_without_a_common_agent_are_rejected():
    with pytest.raises(ValueError, match="must have an agent in common, got a and b"):
        load("benefit_risk").points_of(threats(["a"], [True]), traffic({"b": 0.0}))


def test_runs_in_the_other_order_are_rejected():
    with pytest.raises(ValueError, match="in this order, got traffic and everyday-threats"):
        load("benefit_risk").points_of(traffic({"a": 0.0}), threats(["a"], [True]))


def test_agents_that_have_not_played_are_left_out():
    failed = threat_row("b", "everyday-threats/LowBox/v1", threat=None, fcw_driver=False, error="Error")
    runs = threats(["a"], [True])
    runs.config.agents, runs.rows = ["a", "b"], [*runs.rows, failed]
    points = load("benefit_risk").points_of(runs, traffic({"a": 1.0, "b": 1.0}))
    assert [point.agent for point in points] == ["a"]
