"""The objective: values of rows, replay on recordings against closed loop, and the cache of recordings."""

import pytest

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import make_env
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.envs.appearance import brake_of, world_weather
from lgmd_gym.tuning import objective as objective_module
from lgmd_gym.tuning.objective import Objective, ObjectiveValue, find_onset, is_latching


def threat_row(impact_speed, premature=False):
    return {
        "threat": True,
        "premature_brake": premature,
        "relative_impact_speed": impact_speed,
        "speed_reduction": 10.0 - (impact_speed or 0.0),
        "false_activation": False,
    }


def test_the_value_is_avoided_energy_minus_the_cost_of_false_activations():
    """Impact at 0, 5 and 10 of 10 m/s, and premature braking: (1 + 0.75 + 0 + 0) / 4."""
    threats = [threat_row(None), threat_row(5.0), threat_row(10.0), threat_row(None, premature=True)]
    others = [{"threat": False, "false_activation": item} for item in (True, False)]
    value = ObjectiveValue.from_rows(threats + others)
    assert value == ObjectiveValue(0.4375, 0.5, 4, 2)
    assert value.total(2.0) == 0.4375 - 1.0


@pytest.mark.parametrize(
    ("agent", "levels", "cases"),
    [
        ("frame-difference", 4, 0),
        pytest.param("spike-threshold:threshold=150,frames=3", 12, 0, marks=pytest.mark.slow),
        pytest.param("stopping-zone", 9, 5, marks=pytest.mark.slow),
    ],
)
def test_replay_on_recordings_equals_closed_loop(agent, levels, cases):
    objective, rule = Objective("train", levels, seeds=min(cases, 1)), make_agent(agent)
    del objective.tasks[levels + cases :]
    objective.evaluate("no-brake")
    objective.evaluate("spike-threshold")  # recordings of other sensors must not interfere
    sensors = SensorConfig().for_agent(rule)
    value, rows = objective.evaluate(agent), objective.closed_loop_rows(agent, sensors)
    assert value == ObjectiveValue.from_rows(rows)
    assert value.threats > 0
    assert value.non_threats > 0
    onsets = [find_onset(rule, recording) for recording in objective.recordings(sensors)]
    assert {onset is None for onset in onsets} == {True, False}  # it brakes in some episodes and not in all
    keys = ("collision", "relative_impact_speed", "ttc_at_brake", "duration", "episode_return")
    replayed = [objective._rows[key] for key in enumerate(onsets)]
    assert [[row[key] for key in keys] for row in replayed] == [[row[key] for key in keys] for row in rows]


def test_recordings_of_the_latest_four_sensors_are_cached(monkeypatch):
    objective, recorded = Objective("train", 1, 0), []

    def record(task):
        recorded.append(task.sensor_config)
        return task.sensor_config

    monkeypatch.setattr(objective_module, "record", record)
    wide, tele, fovea, standard, paper = (
        SensorConfig(camera=name) for name in ("wide", "tele", "fovea", "standard", "paper")
    )
    for sensors in (wide, tele, fovea, standard, wide, paper, wide, tele):
        assert objective.recordings(sensors)[0].camera == sensors.camera
    assert [item.camera for item in recorded] == [
        *("wide", "tele", "fovea", "standard", "paper"),
        "tele",  # the least recently used when paper was recorded
    ]


@pytest.mark.parametrize("split", ["train", "validation"])
def test_episodes_are_in_worlds_of_the_split(split):
    """Also the brake is that of the world."""
    tasks = Objective(split, 2, 1).tasks
    cases = tasks[2:]
    assert {task.world for task in cases} < set(SPLIT_WORLDS[split])
    assert len({task.world for task in cases}) > 30
    level, case = (make_env(task.case, task.sensor_config, task.arguments) for task in (tasks[0], cases[0]))
    assert level.reset(seed=0)[1]["world"] in SPLIT_WORLDS[split]
    assert case.reset(seed=0)[1]["world"] == cases[0].world
    scene = case.unwrapped.scene
    assert scene.weather.name == world_weather(cases[0].world)
    assert case.unwrapped.brake == brake_of(scene)


def test_only_latching_rules_are_replayed():
    assert is_latching(make_agent("spike-threshold"))
    assert not is_latching(make_agent("ttc-oracle"))


@pytest.mark.slow
def test_the_values_of_no_brake_and_always_brake_are_the_bounds():
    objective = Objective("train", 12, 0)
    never, always = objective.evaluate("no-brake"), objective.evaluate("always-brake")
    assert never.threats + never.non_threats == 12
    assert (never.avoided_energy, never.false_rate) == (0.0, 0.0)
    assert always.false_rate == 1.0
