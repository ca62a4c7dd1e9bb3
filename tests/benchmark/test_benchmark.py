"""Rows, counterfactuals, summaries and runs."""

import json
from dataclasses import replace

import numpy as np
import pytest

from lgmd_gym.agents import AGENTS, Agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import SERIES, Episode, SensorConfig, make_env, play
from lgmd_gym.benchmark.metrics import METRICS, Counterfactual, Outcome, brake_onset, metric
from lgmd_gym.benchmark.rows import KEYS, make_row
from lgmd_gym.benchmark.run_cases import Run
from lgmd_gym.benchmark.runs import resume_run
from lgmd_gym.benchmark.suites import SUITES, find_case, find_suite
from lgmd_gym.benchmark.summary import Rate, score, scores, wilson, write_summary
from lgmd_gym.benchmark.task import Task, run_task

SLOW_APPROACH = Case("test/CCRs/v20", "CCRs", (("ego_speed", 5.556),))
THREAT = Counterfactual(True, 5.0, 10.0)
QUIET = Counterfactual(False, float("nan"), float("nan"))


def episode(deceleration, collision=False, relative=float("nan"), alert=None):
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


def test_brake_onset_walks_back():
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


def test_braking_too_early_is_no_success():
    early = make_row("a", SLOW_APPROACH, 0, episode([0] * 5 + [9] * 36), THREAT)
    assert early["premature_brake"]
    assert early["avoided"] is False
    assert early["speed_reduction"] == 10.0


def test_contact_keeps_what_speed_was_lost():
    row = make_row("a", SLOW_APPROACH, 0, episode([0] * 40 + [9], collision=True, relative=4.0), THREAT)
    assert row["avoided"] is False
    assert row["speed_reduction"] == 6.0


@pytest.mark.parametrize(("peak", "false"), [(2.4, False), (2.5, True)])
def test_false_brake_is_a_quarter_g_without_a_threat(peak, false):
    row = make_row("a", SLOW_APPROACH, 0, episode([0, peak, 0]), QUIET)
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


def test_metrics_that_contact_leaves_undefined():
    row = make_row("a", SLOW_APPROACH, 0, episode([0, 9, 9], collision=True, relative=3.0), THREAT)
    assert (row["min_ttc"], row["max_drac"], row["stopping_margin"]) == (0.0, None, None)
    assert row["warning_lead_time"] is None


def test_a_metric_has_one_name():
    with pytest.raises(ValueError, match="'distance' is defined twice"):

        @metric
        def distance(outcome: Outcome):
            return 0.0, True

    assert set(METRICS) <= set(KEYS)


def test_wilson_interval():
    # Newcombe (1998), table I: 81 of 263, and 0 of 20.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)
    assert Rate.of([True, False])[:2] == (1, 2)


def test_score_separates_threats_from_quiet_episodes():
    good = make_row("a", SLOW_APPROACH, 0, episode([0] * 20 + [9] * 21), THREAT)
    false = make_row("a", SLOW_APPROACH, 1, episode([0, 9, 0]), QUIET)
    failed = dict.fromkeys(KEYS) | {"agent": "a", "case": SLOW_APPROACH.name, "error": "boom"}
    item = score("a", "", [good, false, failed])
    assert (item.avoided.k, item.avoided.n) == (1, 1)
    assert (item.false_activations.k, item.false_activations.n) == (1, 1)
    assert item.errors == 1


def test_cases_are_sorted_as_numbers(tmp_path):
    rows = [
        make_row("a", replace(SLOW_APPROACH, name=f"t/CCRs/v{speed}"), 0, episode([0, 0]), THREAT)
        for speed in (50, 5, 10)
    ]
    assert [item.group for item in scores(rows, lambda row: row["case"])] == [
        "t/CCRs/v5",
        "t/CCRs/v10",
        "t/CCRs/v50",
    ]
    write_summary(rows, tmp_path / "summary.csv")
    lines = (tmp_path / "summary.csv").read_text().splitlines()
    assert lines[0].startswith("agent,condition,case,threats,avoided,")
    assert lines[1].startswith("a,clear,t/CCRs/v5,1,1,")
    assert lines[4].startswith("a,clear,all,3,3,")
    assert len(lines) == 5


def test_a_case_at_night_is_seen_at_night():
    frames = {}
    for name in ("CCRs/v30/location50", "CCRs/v30/robust-night"):
        env = make_env(find_case(f"ncap2026/{name}"), SensorConfig("wide"))
        env.reset(seed=0)
        frames[name] = env.get_wrapper_attr("frames")["wide"].mean()
        env.close()
    day, night = frames.values()
    assert night < 0.5 * day


@pytest.mark.parametrize("suite", SUITES)
def test_suites_have_distinct_cases_that_build(suite):
    cases = find_suite(suite).cases
    assert len({case.name for case in cases}) == len(cases)
    for case in cases:
        assert case.suite == suite
        assert f"/{case.scenario.family}/" in case.name
        if f"/{case.family}/v" in case.name:
            assert f"/v{case.scenario.ego_speed * 3.6:.0f}" in case.name
        assert find_case(case.name) == case


def test_unknown_suite_and_case_name_the_nearest():
    with pytest.raises(ValueError, match="unknown suite 'quik'; did you mean 'quick'"):
        find_suite("quik")
    with pytest.raises(ValueError, match="did you mean 'quick/CCRs/v30'"):
        find_case("quick/CCRs/v3")


def test_what_an_episode_shows_is_what_happened():
    env = make_env(SLOW_APPROACH, SensorConfig())
    played = play(env, AGENTS["no-brake"](), 0)
    assert played.collision
    assert played.relative_impact_speed == pytest.approx(5.556)
    assert Counterfactual.of(played).contact_time == pytest.approx(5.0, abs=0.05)
    assert played.series["spike_frequency"].max() > 30
    assert {len(values) for values in played.series.values()} == {len(played.series["time"])}


class Broken(Agent):
    """Fails in the middle of an episode."""

    name = "broken"

    def demand(self, observation, info):
        if info["ttc"] < 4:
            raise RuntimeError("out of ideas")
        return 0.0


def test_a_failing_agent_becomes_a_row(monkeypatch):
    monkeypatch.setitem(AGENTS, "broken", Broken)
    result = run_task(Task("broken", SLOW_APPROACH, 0, SensorConfig(), THREAT))
    assert "out of ideas" in result.row["error"]
    assert result.row["collision"] is None


@pytest.fixture(scope="module")
def quick_run(tmp_path_factory):
    """The quick suite, one seed, in this process."""
    agents = ["always-brake", "ttc-oracle", "spike-threshold"]
    run = Run("quick", agents, 1, 1, tmp_path_factory.mktemp("runs") / "quick")
    assert run.play()
    return run


def test_run_plays_everything_once(quick_run):
    assert len(quick_run.rows) == quick_run.total == 4 * len(SUITES["quick"].cases)
    lines = (quick_run.folder.path / "episodes.jsonl").read_text().splitlines()
    assert [json.loads(line) for line in lines] == quick_run.rows
    assert len({(row["agent"], row["case"], row["seed"]) for row in quick_run.rows}) == quick_run.total
    assert all(row["error"] is None for row in quick_run.rows)
    settings = json.loads((quick_run.folder.path / "run.json").read_text())
    assert settings["complete"] is True
    assert settings["packages"]["numpy"] == np.__version__


def test_the_main_job(quick_run):
    """What issue after issue builds on: the bounds hold, and the neuron stops the car where it should."""

    def rows(agent, family=""):
        return [row for row in quick_run.rows if row["agent"] == agent and f"/{family}" in row["case"]]

    assert all(row["avoided"] is not True for row in rows("no-brake"))
    assert all(row["collision"] for row in rows("no-brake", "CCR"))
    assert not any(
        row["collision"]
        for name in ("AdjacentPass", "Following", "EmptyRoad")
        for row in rows("no-brake", name)
    )
    assert all(row["avoided"] for row in rows("ttc-oracle", "CCR"))
    assert not any(row["false_activation"] for row in rows("ttc-oracle"))
    assert not any(row["avoided"] for row in rows("always-brake"))
    assert all(row["false_activation"] for row in rows("always-brake") if not row["threat"])
    slow = [row for row in rows("spike-threshold", "CCRs") if row["ego_speed"] * 3.6 < 41]
    assert len(slow) == 4
    assert all(row["avoided"] for row in slow)
    for family in ("EmptyRoad", "Following"):
        assert not any(row["false_activation"] for row in rows("spike-threshold", family))


def test_processes_give_the_same_rows(quick_run, tmp_path):
    run = Run("quick", quick_run.agents, 1, 2, tmp_path / "two")
    assert run.play()

    def key(row):
        return row["agent"], row["case"]

    assert sorted(run.rows, key=key) == sorted(quick_run.rows, key=key)


def test_interrupted_run_keeps_its_rows(tmp_path):
    run = Run("quick", ["no-brake"], 1, 1, tmp_path / "run")

    def stop(row):
        if len(run.rows) == 3:
            raise KeyboardInterrupt

    assert not run.play(stop)
    assert len((tmp_path / "run" / "episodes.jsonl").read_text().splitlines()) == 3
    assert json.loads((tmp_path / "run" / "run.json").read_text())["complete"] is False


@pytest.mark.parametrize("cut", [0.3, 0.6, 0.9])
def test_a_broken_off_run_resumes_to_the_same_rows(quick_run, tmp_path, cut):
    """As after kill -9: part of the rows, the last one cut off in the middle, run.json from the start."""
    folder = tmp_path / "run"
    Run("quick", quick_run.agents, 1, 1, folder).play()
    whole = (folder / "episodes.jsonl").read_bytes()
    (folder / "episodes.jsonl").write_bytes(whole[: int(cut * len(whole))])
    run = resume_run(folder, 1)
    assert run.folder.mended
    kept = len(run.rows)
    assert 0 < kept < run.total
    played = []
    assert run.play(played.append)
    assert len(played) == run.total - kept
    rows = [json.loads(line) for line in (folder / "episodes.jsonl").read_text().splitlines()]

    def key(row):
        return row["agent"], row["case"]

    assert sorted(rows, key=key) == sorted(quick_run.rows, key=key) == sorted(run.rows, key=key)


def test_what_cannot_be_resumed_is_refused(tmp_path):
    with pytest.raises(ValueError, match="holds no run"):
        resume_run(tmp_path, 1)
    Run("quick", ["no-brake"], 1, 1, tmp_path / "run").play(
        lambda row: (_ for _ in ()).throw(KeyboardInterrupt)
    )
    settings = json.loads((tmp_path / "run" / "run.json").read_text())
    (tmp_path / "run" / "run.json").write_text(json.dumps(settings | {"lgmd_gym": "0.0.1"}))
    with pytest.raises(ValueError, match=r"made by lgmd-gym 0.0.1, this is .*; start a new run"):
        resume_run(tmp_path / "run", 1)
    (tmp_path / "run" / "episodes.jsonl").write_text("{}\nnonsense\n{}\n")
    with pytest.raises(ValueError, match="damaged in line 2"):
        resume_run(tmp_path / "run", 1)


def test_the_python_function_returns_a_table(quick_run):
    from lgmd_gym.benchmark import run

    table = run("quick", ["ttc-oracle"], seeds=1)
    assert list(table.columns) == list(KEYS)
    assert len(table) == 2 * len(SUITES["quick"].cases)
    oracle = table[(table.agent == "ttc-oracle") & table.threat]
    assert oracle.avoided.all()


def test_bad_runs_are_refused_before_anything_is_played(tmp_path):
    (tmp_path / "there").mkdir()
    for arguments, words in [
        (("quik", ["no-brake"], 1, 1, tmp_path / "a"), "did you mean 'quick'"),
        (("quick", ["nobrake"], 1, 1, tmp_path / "a"), "did you mean 'no-brake'"),
        (("quick", [], 1, 1, tmp_path / "a"), "at least one"),
        (("quick", ["no-brake"], 0, 1, tmp_path / "a"), "seeds must be a whole number >= 1, got 0"),
        (("quick", ["no-brake"], 1, 0, tmp_path / "a"), "jobs must be >= 1, got 0"),
        (("quick", ["no-brake"], 1, 1, tmp_path / "there"), "exists and is kept"),
        (("quick", ["no-brake"], 1, 1, tmp_path / "a", SensorConfig("fova")), "did you mean 'fovea'"),
    ]:
        with pytest.raises(ValueError, match=words):
            Run(*arguments)
    assert [path.name for path in tmp_path.iterdir()] == ["there"]
