"""Episodes, metrics, rows, summaries and runs of suites of cases."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.runs import interrupt, new_run, read_rows, sorted_rows

from lgmd_gym.agents import AGENTS, Agent
from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark import run as run_benchmark
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import SERIES, Episode, make_env, play
from lgmd_gym.benchmark.executor import Executor
from lgmd_gym.benchmark.metrics import METRICS, Counterfactual, brake_onset, metric
from lgmd_gym.benchmark.rows import KEYS, make_row
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import SUITES, find_case, find_suite
from lgmd_gym.benchmark.summary import COLUMNS, summaries, summarise, write_summary
from lgmd_gym.benchmark.task import Task, run_task
from lgmd_gym.camera import CameraParams
from lgmd_gym.cli import main as cli

SLOW_APPROACH = Case("test/CCRs/v20", "CCRs", (("ego_speed", 5.556),))
THREAT = Counterfactual(True, 5.0, 10.0)
NO_THREAT = Counterfactual(False, float("inf"), float("inf"))
BOUNDS = ("no-brake", "always-brake", "ttc-oracle", "spike-threshold")


def episode(deceleration, collision=False, relative=float("inf"), alert=None):
    """Return an episode at 10 Hz and 10 m/s with a time to contact from 5 to 1 s."""
    n = len(deceleration)
    series = {name: np.zeros(n) for name in SERIES}
    series["time"] = np.arange(n) / 10
    series["ego_speed"] = np.full(n, 10.0)
    series["ttc"] = np.linspace(5, 1, n)
    series["gap"] = 10 * series["ttc"]
    series["deceleration"] = np.asarray(deceleration, float)
    if alert is not None:
        series["alert"][alert:] = 1.0
    return Episode(series, collision, relative, relative, 1.712, 30.0)


def test_brake_onset_is_traced_back_to_0_3():
    assert brake_onset(np.zeros(5)) is None
    assert brake_onset(np.array([0, 0.2, 0.5, 0.9, 1.1, 9.0])) == 1
    assert brake_onset(np.array([2.0, 3.0])) == 0
    assert brake_onset(np.array([0, 0.9, 0.9, 0])) is None


def test_row_of_an_avoided_threat():
    row = make_row("a", SLOW_APPROACH, 3, episode([0] * 20 + [9] * 21, alert=18), THREAT)
    assert tuple(row) == KEYS
    assert (row["threat"], row["collision"], row["avoided"], row["premature_brake"]) == (
        True,
        False,
        True,
        False,
    )
    assert row["speed_reduction"] == 10.0
    assert row["impact_speed"] is None
    assert row["ttc_at_brake"] == pytest.approx(np.linspace(5, 1, 41)[19])
    assert row["ttc_at_alert"] == pytest.approx(np.linspace(5, 1, 41)[18])
    gap = 10 * row["ttc_at_alert"]
    assert row["theta_at_alert_deg"] == pytest.approx(np.degrees(2 * np.arctan(0.856 / gap)))
    assert row["l_over_v_ms"] == pytest.approx(85.6)
    assert row["error"] is None
    assert json.loads(json.dumps(row, allow_nan=False)) == row


def test_premature_braking_does_not_count_as_avoided():
    early = make_row("a", SLOW_APPROACH, 0, episode([0] * 5 + [9] * 36), THREAT)
    assert early["premature_brake"]
    assert early["avoided"] is False
    assert early["speed_reduction"] == 10.0


def test_contact_after_braking_reduces_the_speed():
    row = make_row("a", SLOW_APPROACH, 0, episode([0] * 40 + [9], collision=True, relative=4.0), THREAT)
    assert row["avoided"] is False
    assert row["speed_reduction"] == 6.0


@pytest.mark.parametrize(("peak", "false"), [(2.4, False), (2.5, True)])
def test_false_activation_exceeds_a_quarter_g_without_a_threat(peak, false):
    row = make_row("a", SLOW_APPROACH, 0, episode([0, peak, 0]), NO_THREAT)
    assert row["false_activation"] is false
    assert row["avoided"] is None
    assert row["speed_reduction"] is None
    assert not make_row("a", SLOW_APPROACH, 0, episode([0, peak, 0]), THREAT)["false_activation"]


def test_metrics_of_an_avoided_threat():
    braked = episode([0] * 20 + [2, 4, 6] + [9] * 18, alert=18)
    braked.series["drac"][:] = np.linspace(1, 5, 41)
    row = make_row("a", SLOW_APPROACH, 0, braked, THREAT)
    assert row["warning_lead_time"] == pytest.approx(0.4)  # alert at 1.8 s, 5 m/s² at 2.2 s
    assert row["distance_at_alert"] == pytest.approx(10 * row["ttc_at_alert"])
    assert row["distance_at_brake"] == pytest.approx(10 * row["ttc_at_brake"])
    assert (row["min_ttc"], row["stopping_margin"], row["max_drac"]) == pytest.approx((1.0, 10.0, 5.0))
    assert row["drac_at_brake"] == pytest.approx(np.linspace(1, 5, 41)[19])


def test_contact_leaves_some_metrics_undefined():
    row = make_row("a", SLOW_APPROACH, 0, episode([0, 9, 9], collision=True, relative=3.0), THREAT)
    assert (row["min_ttc"], row["max_drac"], row["stopping_margin"]) == (0.0, None, None)
    assert row["warning_lead_time"] is None


def test_metric_names_are_unique():
    with pytest.raises(ValueError, match="'distance' is defined twice"):

        @metric
        def distance(pair):
            return 0.0, True

    assert set(METRICS) <= set(KEYS)


def test_summary_separates_threats_from_non_threats():
    good = make_row("a", SLOW_APPROACH, 0, episode([0] * 20 + [9] * 21), THREAT)
    false = make_row("a", SLOW_APPROACH, 1, episode([0, 9, 0]), NO_THREAT)
    failed = dict.fromkeys(KEYS) | {"agent": "a", "case": SLOW_APPROACH.name, "error": "Traceback"}
    item = summarise("a", "", [good, false, failed])
    assert (item.avoided.k, item.avoided.n) == (1, 1)
    assert (item.false_activations.k, item.false_activations.n) == (1, 1)
    assert item.errors == 1


def test_summary_orders_cases_by_number(tmp_path):
    rows = [
        make_row("a", replace(SLOW_APPROACH, name=f"t/CCRs/v{speed}"), 0, episode([0, 0]), THREAT)
        for speed in (50, 5, 10)
    ]
    cases = ["t/CCRs/v5", "t/CCRs/v10", "t/CCRs/v50"]
    assert [item.group for item in summaries(rows, lambda row: row["case"])] == cases
    write_summary(rows, tmp_path / "summary.csv")
    lines = [line.split(",") for line in (tmp_path / "summary.csv").read_text().splitlines()]
    assert tuple(lines[0]) == COLUMNS
    assert [line[:5] for line in lines[1:]] == [
        *(["a", "clear", case, "1", "1"] for case in cases),
        ["a", "clear", "all", "3", "3"],
    ]


def test_night_case_renders_dark_frames():
    means = {}
    for name in ("CCRs/v30/location50", "CCRs/v30/robust-night"):
        env = make_env(find_case(f"ncap2026/{name}"), SensorConfig("wide"))
        env.reset(seed=0)
        means[name] = env.get_wrapper_attr("frames")["wide"].mean()
        env.close()
    day, night = means.values()
    assert night < 0.5 * day


TELE = CameraParams.preset("tele")


@pytest.mark.parametrize("camera", ["tele", {"name": "tele"}, TELE, SensorConfig(TELE).plain.camera])
def test_condition_applies_to_every_kind_of_camera_argument(camera):
    foggy = SensorConfig([camera]).with_condition("fog").arguments["camera"]
    assert foggy == [TELE.with_condition("fog")]


def test_plain_camera_contains_only_the_changes_to_its_preset():
    camera = CameraParams.preset("tele", pitch_deg=1.5)
    plain = SensorConfig(camera).plain.camera
    assert plain == {"name": "tele", "pitch_deg": 1.5}
    assert CameraParams.make(plain) == camera


def test_birdseye_camera_supports_no_condition():
    with pytest.raises(ValueError, match="'birdseye' does not support condition 'fog'; use 'clear'"):
        SensorConfig("birdseye").with_condition("fog")


def test_suite_cases_have_distinct_names_and_valid_scenarios():
    offenders = []
    for suite in SUITES.values():
        names = [case.name for case in suite.cases]
        offenders += [name for name in set(names) if names.count(name) > 1]
        for case in suite.cases:
            valid = case.suite == suite.name and f"/{case.scenario.family}/" in case.name
            if f"/{case.family}/v" in case.name:
                valid = valid and f"/v{case.scenario.ego_speed * 3.6:.0f}" in case.name
            if not valid or find_case(case.name) != case:
                offenders.append(case.name)
    assert offenders == []


def test_unknown_suite_and_case_suggest_the_nearest_name():
    with pytest.raises(ValueError, match="unknown suite 'quik'; did you mean 'quick'"):
        find_suite("quik")
    with pytest.raises(ValueError, match="did you mean 'quick/CCRs/v30'"):
        find_case("quick/CCRs/v3")


def test_played_episode_has_contact_at_the_expected_time_and_speed():
    env = make_env(SLOW_APPROACH, SensorConfig())
    played = play(env, AGENTS["no-brake"](), 0)
    assert played.collision
    assert played.relative_impact_speed == pytest.approx(5.556)
    assert Counterfactual.of(played).contact_time == pytest.approx(5.0, abs=0.05)
    assert played.series["spike_frequency"].max() > 30
    assert tuple(played.series) == SERIES
    assert {len(values) for values in played.series.values()} == {len(played.series["time"])}


class Broken(Agent):
    """Raises an exception in the middle of an episode."""

    name = "broken"

    def demand(self, observation, info):
        if info["ttc"] < 4:
            raise RuntimeError("internal failure")
        return 0.0


def test_exception_of_an_agent_becomes_an_error_row(monkeypatch):
    monkeypatch.setitem(AGENTS, "broken", Broken)
    result = run_task(Task("broken", SLOW_APPROACH, 0, SensorConfig(), THREAT))
    assert "internal failure" in result.row["error"]
    assert result.row["collision"] is None


@pytest.fixture(scope="module")
def quick_run(tmp_path_factory):
    """The quick suite with one seed, run in this process."""
    run = new_run(tmp_path_factory.mktemp("runs") / "quick", agents=BOUNDS[1:], seeds=1)
    assert run.play()
    return run


def test_every_episode_runs_once(quick_run):
    assert len(quick_run.rows) == quick_run.total == 4 * len(SUITES["quick"].cases)
    assert read_rows(quick_run.folder.path) == quick_run.rows
    assert len({(row["agent"], row["case"], row["seed"]) for row in quick_run.rows}) == quick_run.total
    assert all(row["error"] is None for row in quick_run.rows)
    settings = json.loads((quick_run.folder.path / "run.json").read_text())
    assert settings["complete"] is True
    assert settings["packages"]["numpy"] == np.__version__


def test_bounding_agents_and_the_neuron_behave_as_documented(quick_run):
    def rows(agent, family=""):
        return [row for row in quick_run.rows if row["agent"] == agent and f"/{family}" in row["case"]]

    assert all(row["avoided"] is not True for row in rows("no-brake"))
    assert all(row["collision"] for row in rows("no-brake", "CCR"))
    for family in ("AdjacentPass", "Following", "EmptyRoad"):
        assert not any(row["collision"] for row in rows("no-brake", family))
    assert all(row["avoided"] for row in rows("ttc-oracle", "CCR"))
    assert not any(row["false_activation"] for row in rows("ttc-oracle"))
    assert not any(row["avoided"] for row in rows("always-brake"))
    assert all(row["false_activation"] for row in rows("always-brake") if not row["threat"])
    slow = [row for row in rows("spike-threshold", "CCRs") if row["ego_speed"] * 3.6 < 41]
    assert len(slow) == 4
    assert all(row["avoided"] for row in slow)
    for family in ("EmptyRoad", "Following"):
        assert not any(row["false_activation"] for row in rows("spike-threshold", family))


def test_number_of_processes_does_not_change_the_rows(quick_run, tmp_path):
    run = new_run(tmp_path / "two", jobs=2, agents=BOUNDS[1:], seeds=1)
    assert run.play()
    assert sorted_rows(run.rows) == sorted_rows(quick_run.rows)


def test_interrupted_run_keeps_its_rows(tmp_path):
    run = new_run(tmp_path / "run", agents=["no-brake"], seeds=1)

    def interrupt_after_three(row):
        if len(run.rows) == 3:
            raise KeyboardInterrupt

    assert not run.play(interrupt_after_three)
    assert run.stop_reason == "interrupted"
    assert len(read_rows(tmp_path / "run")) == 3
    assert json.loads((tmp_path / "run" / "run.json").read_text())["complete"] is False


@pytest.mark.parametrize("fraction", [0.3, 0.6, 0.9])
def test_resumed_run_has_the_rows_of_a_complete_one(quick_run, tmp_path, fraction):
    """The folder is left as by kill -9: some rows, the last one incomplete."""
    folder = tmp_path / "run"
    interrupted = new_run(folder, agents=BOUNDS[1:], seeds=1)
    assert not interrupted.play(interrupt)
    whole = (quick_run.folder.path / "episodes.jsonl").read_bytes()
    (folder / "episodes.jsonl").write_bytes(whole[: int(fraction * len(whole))])
    run = Run.resume(folder)
    assert run.folder.repaired
    before = len(run.rows)
    assert 0 < before < run.total
    played = []
    assert run.play(played.append)
    assert len(played) == run.total - before
    assert sorted_rows(read_rows(folder)) == sorted_rows(quick_run.rows) == sorted_rows(run.rows)


def test_resume_rejects_missing_damaged_and_older_runs(tmp_path):
    with pytest.raises(ValueError, match="contains no run"):
        Run.resume(tmp_path)
    new_run(tmp_path / "run", agents=["no-brake"], seeds=1).play(interrupt)
    settings = json.loads((tmp_path / "run" / "run.json").read_text())
    (tmp_path / "run" / "run.json").write_text(json.dumps(settings | {"lgmd_gym": "0.0.1"}))
    with pytest.raises(ValueError, match=r"made by lgmd-gym 0.0.1, this is .*; start a new run"):
        Run.resume(tmp_path / "run")
    (tmp_path / "run" / "episodes.jsonl").write_text("{}\nnonsense\n{}\n")
    with pytest.raises(ValueError, match="damaged in line 2"):
        Run.resume(tmp_path / "run")


def test_python_function_and_command_write_the_same_folder(tmp_path):
    config = RunConfig(suite="r152", agents=("ttc-oracle", "spike-threshold"), seeds=1)
    table = run_benchmark(config, tmp_path / "python")
    flags = ["--suite", "r152", "--agents", "ttc-oracle", "spike-threshold", "--seeds", "1", "--jobs", "1"]
    assert cli.run(["bench", *flags, "--out", str(tmp_path / "command")]) == 0

    def files(name):
        return sorted(str(path.relative_to(tmp_path / name)) for path in (tmp_path / name).rglob("*"))

    assert files("python") == files("command")
    assert {"summary.csv", "froc.csv", "plots", "report.html", "run.toml"} < set(files("python"))
    assert read_rows(tmp_path / "python") == read_rows(tmp_path / "command")
    for name in ("summary.csv", "froc.csv"):
        assert (tmp_path / "python" / name).read_text() == (tmp_path / "command" / name).read_text()
    assert RunConfig.load(tmp_path / "python" / "run.toml") == RunConfig.load(
        tmp_path / "command" / "run.toml"
    )
    assert list(table.columns) == list(KEYS)
    assert len(table) == 3 * len(SUITES["r152"].cases)
    assert table[table.agent == "ttc-oracle"].avoided.all()


def test_run_requires_a_configuration(tmp_path):
    with pytest.raises(TypeError, match="config must be a RunConfig, got 'quick'"):
        run_benchmark("quick", tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"suite": "quik"}, "did you mean 'quick'"),
        ({"suite": "trafic"}, "did you mean 'traffic'"),
        ({"agents": ["nobrake"]}, "did you mean 'no-brake'"),
        ({"agents": []}, "agents must contain at least one name, got none"),
        ({"agents": "no-brake"}, "agents must be a list of strings, got 'no-brake'"),
        ({"conditions": ["fogg"]}, "did you mean 'fog'"),
        ({"kinds": ["merge"]}, "kinds applies to suite 'traffic' only"),
        ({"seeds": 0}, "seeds must be a whole number >= 1, got 0"),
        ({"seeds": 1.5}, "seeds must be a whole number >= 1, got 1.5"),
        ({"first_seed": -1}, "first_seed must be a whole number >= 0, got -1"),
        ({"camera": "fova"}, "did you mean 'fovea'"),
        ({"params": {"sigma_33": 1.0}}, "did you mean 'sigma_3'"),
    ],
)
def test_invalid_configuration_is_rejected_before_the_folder_is_created(tmp_path, values, message):
    with pytest.raises(ValueError, match=message):
        new_run(tmp_path / "run", **{"agents": ["no-brake"], "seeds": 1} | values)
    assert list(tmp_path.iterdir()) == []


def test_existing_folder_and_zero_jobs_are_rejected(tmp_path):
    with pytest.raises(ValueError, match="already exists"):
        new_run(tmp_path, agents=["no-brake"])
    with pytest.raises(ValueError, match="jobs must be >= 1, got 0"):
        Executor(jobs=0)
