"""Summaries and runs of the traffic suite."""

import csv
import json
import os

import pytest
from rich.console import Console
from support.runs import interrupt, new_run, read_rows, sorted_rows

from lgmd_gym.agents import AGENTS, BatchAgent
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.traffic.rows import KEYS
from lgmd_gym.benchmark.traffic.summary import (
    COLUMNS,
    traffic_summaries,
    traffic_table,
    write_traffic_summary,
)

SHORT = {"duration": 12}


def row(agent="a", kind="merge", **values):
    """Return a row with zeros for all counts and lengths."""
    identity = {"agent": agent, "case": f"traffic/{kind}/s0", "family": kind, "condition": "clear"}
    counts = ("alerts", "brakes", "false_activations", "stops")
    counts += ("needless_activations", "peak_deceleration", "distance", "moving_time", "needed_time")
    zeros = dict.fromkeys((*counts, "scaled_needed_time", "speed_lost"), 0)
    flags = dict.fromkeys(("collision", "threat", "caused"), False)
    return dict.fromkeys(KEYS) | identity | zeros | flags | values


@pytest.fixture
def summary_rows():
    return [
        row(
            distance=150_000.0,
            brakes=3,
            false_activations=2,
            needless_activations=1,
            speed_lost=12.0,
            alerts=6,
            moving_time=100.0,
            needed_time=4.0,
            scaled_needed_time=7.0,
        ),
        row(
            distance=150_000.0,
            kind="highway",
            threat=True,
            avoided=True,
            avoidable=True,
            avoided_by_brake=True,
        ),
        row(
            agent="b",
            distance=100_000.0,
            collision=True,
            side="rear",
            impact_speed=0.4,
            threat=True,
            avoided=False,
            avoidable=False,
            caused=True,
        ),
        row(agent="b", error="Traceback"),
    ]


def test_summary_adds_up_the_episodes_of_an_agent(summary_rows):
    a, b = traffic_summaries(summary_rows)
    assert (a.distance, a.drives, a.false_activations, a.needless, a.brakes) == (300_000.0, 2, 2, 1, 3)
    assert a.per_100km(a.needless) == pytest.approx(1 / 3)
    assert a.needless_interval == (pytest.approx(0.0253 / 3, abs=1e-4), pytest.approx(5.572 / 3, abs=1e-3))
    assert a.per_100km(a.speed_lost) == pytest.approx(4.0)
    assert (a.needed_share, a.scaled_needed_share) == (0.04, 0.07)
    assert (a.avoided.k, a.avoided.n) == (a.avoided_by_brake.k, a.avoided_by_brake.n) == (1, 1)
    assert (a.unavoidable, a.caused, a.standing) == (0, 0, 0)
    assert (b.avoided_by_brake.n, b.unavoidable, b.caused, b.standing) == (0, 1, 1, 1)
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
    assert (values["distance_km"], values["false_per_100km"]) == ("300.0000", "0.6667")
    assert (values["needless_per_100km"], values["speed_lost_per_100km"]) == ("0.3333", "4.0000")
    counts = ("avoidable", "avoidable_met", "avoided_by_brake", "unavoidable")
    assert [values[name] for name in counts] == ["1", "1", "1", "0"]


def test_table_shows_rates_with_intervals(summary_rows):
    console = Console(width=120, markup=False, record=True, file=open(os.devnull, "w"))  # noqa: SIM115
    console.print(traffic_table(summary_rows, ["a", "b"], "title"))
    text = console.export_text()
    assert "0.3 [0.0–1.9]" in text
    assert " 1/1 (+0) " in text
    assert " 1 (1, 1) " in text
    assert "b (1 error)" in text
    assert "clustered by drive" in text


def test_upper_bound_of_no_false_activation_in_300_km():
    (item,) = traffic_summaries([row(distance=300_000.0)])
    assert item.interval == (0.0, pytest.approx(1.2296, abs=1e-4))


def test_run_writes_rows_as_they_finish(tmp_path, monkeypatch):
    class Faulty(BatchAgent):
        def demands(self, observations, infos, active):
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
    values = {"suite": "traffic", "kinds": ["merge", "intersection"], "seeds": 1}
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
        (
            {"agents": ["last-moment-oracle"], "suite": "traffic-inattentive"},
            "last-moment-oracle requires braking environments, got suite traffic-inattentive; omit the agent",
        ),
    ],
)
def test_invalid_configuration_is_rejected_before_the_folder_is_created(tmp_path, values, message):
    with pytest.raises(ValueError, match=message):
        new_run(tmp_path / "run", **{"suite": "traffic", "agents": ["no-brake"], "seeds": 1} | values)
    assert list(tmp_path.iterdir()) == []
