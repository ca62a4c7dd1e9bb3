"""Batches of tasks on the engine give the results of the same tasks run one by one."""

import dataclasses
import os
from dataclasses import replace

import numpy as np
import pytest
from support.brakes import draw_all_brakes
from support.runs import new_run, read_rows, sorted_rows

from lgmd_gym.agents import AGENTS
from lgmd_gym.benchmark import player
from lgmd_gym.benchmark.case import key_of, level_case
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.player import BatchPlayer, play_unit, run_task
from lgmd_gym.benchmark.run_folder import read_series, series_name
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_case
from lgmd_gym.benchmark.task import Task
from lgmd_gym.benchmark.units import make_units
from lgmd_gym.processes.pool import Executor

THREAT = Counterfactual(True, 5.0, 10.0)
DEFAULT_SENSORS = SensorConfig()
CASES = (
    find_case("quick/CCRs/v10"),
    find_case("quick/CCRs/v50"),
    find_case("quick/EmptyRoad/v80"),
    find_case("false-reaction/CurveGuardRail/v50/left"),
    find_case("ncap2026-robustness/CCRs/v30/night"),
    level_case("random", "test", 3),
)


class Cautious:
    """A user's agent with a state, which keeps its observations and reads every kind of info."""

    def __init__(self, limit=2.0):
        self.limit = limit

    def reset(self, seed):
        self.observations, self.alert, self.frames = [], seed % 2 == 0, 0

    def act(self, observation, info):
        assert len(info["lgmd/trace"]) == 1
        frame = info["lgmd/trace"][0]
        assert frame.time == pytest.approx(self.frames / 30)
        assert frame.ego_speed == info["ego_speed"]
        assert np.float32(frame.response.ffi[0]) == observation["ffi"][0]
        assert info["lgmd/fovea/ffi"] == frame.response.ffi[0]
        self.observations.append(observation)
        self.frames += 1
        total = sum(float(old["spike_frequency"][0]) for old in self.observations)
        return -1.0 if info["ttc"] < self.limit else -min(total / 3000.0, 0.3)


class Faulty:
    """Raises, exits or returns NaN in the middle of an episode, depending on the seed."""

    def reset(self, seed=None):
        self.seed, self.left = seed, 40

    def act(self, observation, info):
        self.left -= 1
        if self.left < 0 and self.seed == 1:
            raise RuntimeError("internal failure")
        if self.left < 0 and self.seed == 2:
            raise SystemExit(3)
        return float("nan") if self.left < 0 and self.seed == 3 else 0.0


def make_tasks(agent, cases=CASES, seeds=(0, 1), sensors=DEFAULT_SENSORS, condition="clear"):
    return [Task(agent, case, seed, sensors, THREAT, condition) for seed in seeds for case in cases]


def play_batches(tasks, workers=1):
    return [result for unit in make_units(tasks, workers) for result in play_unit(unit)]


def assert_equal_results(played, expected):
    assert len(played) == len(expected)
    expected = {key_of(result.row): result for result in expected}
    for result in played:
        other = expected.pop(key_of(result.row))
        assert list(result.row.items()) == list(other.row.items())
        assert result.counterfactual == other.counterfactual
        assert list(result.series) == list(other.series)
        for name, values in other.series.items():
            assert result.series[name].dtype == values.dtype
            np.testing.assert_array_equal(result.series[name], values, err_msg=name)


@pytest.fixture
def _no_fallback(monkeypatch):
    """Fail if a batch falls back on running tasks one by one."""

    def fail(task):
        raise AssertionError(f"{task.key} was run outside its batch")

    monkeypatch.setattr(player, "run_task", fail)


@pytest.mark.usefixtures("_no_fallback")
@pytest.mark.parametrize("agent", ["no-brake", "random-brake", "spike-threshold", "ttc-oracle"])
def test_batch_gives_the_results_of_single_tasks(agent):
    tasks = make_tasks(agent, seeds=(1,))
    assert_equal_results(play_batches(tasks), list(map(run_task, tasks)))


@pytest.mark.usefixtures("_no_fallback")
@pytest.mark.parametrize(
    "agent",
    [
        "stopping-zone",
        pytest.param("danger-zone", marks=pytest.mark.slow),
        pytest.param("frame-difference", marks=pytest.mark.slow),
    ],
)
def test_batch_with_the_cameras_of_an_agent_gives_the_results_of_single_tasks(agent):
    tasks = make_tasks(agent, CASES[1:4], seeds=(0,))
    assert_equal_results(play_batches(tasks), list(map(run_task, tasks)))


@pytest.mark.usefixtures("_no_fallback")
def test_user_agent_is_called_for_each_environment():
    tasks = make_tasks(f"{__name__}:Cautious:limit=1.5", CASES[:3])
    assert_equal_results(play_batches(tasks), list(map(run_task, tasks)))


@pytest.mark.usefixtures("_no_fallback")
@pytest.mark.parametrize("width", [1, 40])
def test_width_of_a_batch_does_not_change_the_results(monkeypatch, width):
    tasks = make_tasks("spike-threshold", CASES[:3])
    monkeypatch.setattr(player, "WIDTH", width)
    assert_equal_results(play_batches(tasks), list(map(run_task, tasks)))


@pytest.mark.usefixtures("_no_fallback")
@pytest.mark.parametrize("agent", ["ttc-oracle", "stopping-zone"])
def test_fcw_driver_brakes_in_a_batch(agent):
    case = dataclasses.replace(find_case("quick/CCRs/v50"), variant="fcw", fcw_driver=True)
    tasks = make_tasks(agent, (case, CASES[1]), seeds=(0,))
    results = play_batches(tasks)
    assert_equal_results(results, list(map(run_task, tasks)))
    driver, rule = (result.series["deceleration"].max() for result in sorted(results, key=_has_no_driver))
    assert driver == pytest.approx(4.0)
    assert rule == pytest.approx(9.0)


@pytest.mark.usefixtures("_no_fallback")
@pytest.mark.parametrize("agent", ["ttc-oracle", "stopping-zone", f"{__name__}:Cautious:limit=1.5"])
def test_brakes_of_episodes_in_a_batch(monkeypatch, agent):
    """Results with drawn brakes are equal, and the FCW driver decelerates by 4 m/s² with each of them."""
    draw_all_brakes(monkeypatch)
    case = dataclasses.replace(find_case("quick/CCRs/v50"), variant="fcw", fcw_driver=True)
    tasks = make_tasks(agent, (case, CASES[1]), seeds=(0, 1))
    results = play_batches(tasks)
    assert_equal_results(results, list(map(run_task, tasks)))
    limits = set()
    for result in results:
        peak = result.series["deceleration"].max()
        if result.row["fcw_driver"]:
            assert peak == pytest.approx(4.0) or (peak < 4.0 and agent != "ttc-oracle")
        else:
            limits.add(round(float(peak), 3))
    assert len(limits) == 2
    assert 9.0 not in limits


def _has_no_driver(result):
    return not result.row["fcw_driver"]


@pytest.mark.usefixtures("_no_fallback")
def test_conditions_sensors_and_rates_of_tasks_are_kept():
    short = (CASES[0], CASES[2])
    tasks = make_tasks("spike-threshold", short, seeds=(0,), condition="fog")
    tasks += make_tasks("spike-threshold", short, seeds=(0,))
    tasks += make_tasks("spike-threshold", short, (1,), SensorConfig("wide", {"t_sf": 60.0}))
    weak = (*CASES[0].arguments, ("config", {"max_deceleration": 3.0}))
    slow = (*CASES[0].arguments, ("config", {"policy_frequency": 15}))
    cases = [dataclasses.replace(CASES[0], variant=name) for name in ("weak", "slow")]
    cases = [
        dataclasses.replace(case, arguments=values) for case, values in zip(cases, (weak, slow), strict=True)
    ]
    tasks += make_tasks("spike-threshold", cases, seeds=(0,))
    assert len(make_units(tasks, 1)) == 5
    assert_equal_results(play_batches(tasks), list(map(run_task, tasks)))


@pytest.mark.usefixtures("_no_fallback")
def test_failing_agent_costs_its_own_tasks_only():
    tasks = make_tasks(f"{__name__}:Faulty", (CASES[0], CASES[2]), seeds=range(5))
    results = play_batches(tasks)
    words = {1: "internal failure", 2: "SystemExit: 3", 3: "must return one number"}
    failed = [result for result in results if result.row["seed"] in words]
    assert len(failed) == 6
    for result in failed:
        assert words[result.row["seed"]] in result.row["error"]
        assert result.row["collision"] is None
        assert result.series is None
    played = [result for result in results if result.row["error"] is None]
    assert_equal_results(played, [run_task(task) for task in tasks if task.seed in (0, 4)])


def test_tasks_of_a_failing_batch_run_one_by_one(monkeypatch):
    class Recovers(AGENTS["always-brake"]):
        name = "recovers"

        def demands(self, observations, infos, active):
            if self.num_envs > 1:
                raise RuntimeError("failure of the batch")
            return super().demands(observations, infos, active)

    monkeypatch.setitem(AGENTS, "recovers", Recovers)
    tasks = make_tasks("recovers", CASES[:1])
    assert_equal_results(play_batches(tasks), list(map(run_task, tasks)))


def test_cameras_that_an_agent_does_not_support_give_error_rows():
    tasks = make_tasks("stopping-zone", CASES[:1], sensors=SensorConfig("fovea"))
    for result in play_batches(tasks):
        assert "requires its own 17 cameras, got 1" in result.row["error"]


def test_top_views_are_rendered():
    tasks = make_tasks("spike-threshold", CASES[:1], (0,), SensorConfig("birdseye"))
    results = play_batches(tasks)
    assert_equal_results(results, list(map(run_task, tasks)))
    assert results[0].series["ffi"].max() > 0


def test_units_share_an_agent_and_are_spread_over_the_workers():
    tasks = make_tasks("no-brake", seeds=range(30)) + make_tasks("ttc-oracle", seeds=range(5))
    assert [len(unit.tasks) for unit in make_units(tasks, 1)] == [180, 30]
    units = make_units(tasks, 2)
    assert [len(unit.tasks) for unit in units] == [25, 26, 26, 25, 26, 26, 26, 15, 15]
    assert [task for unit in units for task in unit.tasks] == tasks
    assert max(len(unit.tasks) for unit in make_units(tasks * 10, 2)) <= 64
    assert make_units([], 2) == []


def test_several_workers_begin_with_the_units_that_take_longest():
    tasks = [task for agent in ("no-brake", "spike-threshold", "stopping-zone") for task in make_tasks(agent)]
    order = [unit.tasks[0].agent for unit in make_units(tasks, 2)]
    assert order.index("stopping-zone") == 0
    assert order[-1] != "stopping-zone"
    assert make_units(tasks, 1)[0].tasks[0].agent == "no-brake"


LARGE_AGENT = """
import os, pathlib

MEMORY = b"x" * 500_000_000
(pathlib.Path(__file__).parent / f"{os.getpid()}.pid").touch()


class Large:
    def act(self, observation, info):
        return 0.0
"""


@pytest.mark.slow
def test_an_agent_that_needs_memory_does_not_replace_the_worker_processes(tmp_path, monkeypatch):
    pytest.importorskip("psutil", reason="joblib replaces processes only if psutil is installed")
    (tmp_path / "large_agent.py").write_text(LARGE_AGENT)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    config = RunConfig(suite="quick", seeds=1, agents=("large_agent:Large",))
    assert Run.new(config, tmp_path / "run", Executor(jobs=2)).play()
    processes = {path.stem for path in tmp_path.glob("*.pid")} - {str(os.getpid())}
    assert len(processes) == 2


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_run_gives_the_rows_and_series_of_single_tasks(tmp_path, jobs):
    agents = ("spike-threshold", "ttc-oracle")
    run = new_run(tmp_path / "run", jobs=jobs, suite="r152", agents=agents, seeds=1, worlds=4)
    assert run.play()
    expected = []
    for index, case in enumerate(run.plan.suite.cases):
        task = Task("no-brake", case, 0, SensorConfig(), world=run.config.world(0, index))
        first = run_task(task)
        expected.append(first)
        others = (replace(task, agent=name, counterfactual=first.counterfactual) for name in agents)
        expected += [run_task(other) for other in others]
    assert sorted_rows(read_rows(tmp_path / "run")) == sorted_rows([result.row for result in expected])
    for result in expected:
        series = read_series(tmp_path / "run", series_name(key_of(result.row)))
        assert series is not None
        for name, values in result.series.items():
            np.testing.assert_array_equal(series[name], values)


@pytest.mark.usefixtures("_no_fallback")
def test_units_of_a_group_use_the_same_simulation(monkeypatch):
    """The second unit begins after a unit that was not played to its end."""
    made = []
    monkeypatch.setattr(player, "_players", {})

    def make(task, num_envs):
        made.append(num_envs)
        return BatchPlayer(task, num_envs)

    monkeypatch.setattr(player, "BatchPlayer", make)
    tasks = make_tasks("stopping-zone", CASES[1:3], seeds=(0, 1))
    (unit,) = make_units(tasks, 1)
    next(play_unit(unit._replace(tasks=tasks[:2])))
    results = list(play_unit(unit._replace(tasks=tasks[2:])))
    assert made == [player.WIDTH]
    assert_equal_results(results, list(map(run_task, tasks[2:])))
    assert made == [player.WIDTH, 1, 1]
    (again,) = make_units(tasks[:1], 1)  # the files of the agent may have changed
    next(play_unit(again))
    assert made[3:] == [player.WIDTH]
    assert len(player._players) == 1


def test_results_appear_as_episodes_end():
    """The first result of a unit comes before its other episodes end."""
    tasks = make_tasks("no-brake", CASES[:3], seeds=(0,))
    unit = play_unit(make_units(tasks, 1)[0])
    lengths = [result.row["duration"] for result in unit]
    assert lengths == sorted(lengths)
