"""Tuning: what a trial is scored on, what validation chooses, and that a study goes on."""

import pytest

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.cli import main as cli
from lgmd_gym.tuning import objective as tuning_ground
from lgmd_gym.tuning import search as tuning
from lgmd_gym.tuning.space import Space, searched, sensor_config, spelled, tunable


class Known:
    """Ground on which the score is known: best at threshold 100."""

    def __init__(self):
        self.asked = []

    def score(self, agent, sensor_config):
        self.asked.append((agent, sensor_config))
        threshold = make_agent(agent).params.threshold
        return tuning_ground.Score(1.0 - abs(threshold - 100.0) / 300.0, 0.0, 10, 10)


def test_a_study_finds_the_top_and_goes_on(tmp_path):
    pytest.importorskip("optuna")
    study, told = tmp_path / "study.db", []
    train = Known()
    tuning.tune(Space(agent="spike-threshold"), study, 3, train, Known(), tell=told.append)
    assert len(train.asked) == 3
    assert "threshold=30.0" in train.asked[0][0]  # the defaults come first
    found = tuning.tune(Space(agent="spike-threshold"), study, 20, train, Known(), tell=told.append)
    assert len(train.asked) == 23
    assert any(line.startswith("trial 22:") for line in told)
    assert abs(found["threshold"] - 100.0) < 35.0
    make_agent(spelled("spike-threshold", found))


def test_sensitivity_moves_one_parameter_at_a_time():
    rows = tuning.sensitivity(Space(agent="spike-threshold"), Known())
    assert [(name, value) for name, value, _ in rows] == [
        ("threshold", pytest.approx(24.0)),
        ("threshold", pytest.approx(36.0)),
        ("frames", 1),
        ("frames", 2),
    ]


def test_sensitivity_shifts_the_neuron_and_what_places_the_cameras():
    known = Known()
    rows = tuning.sensitivity(Space(agent="spike-threshold", neuron=("sigma_3",)), known)
    assert [(name, value) for name, value, _ in rows[4:]] == [
        ("neuron.sigma_3", 0.8),
        ("neuron.sigma_3", 1.2),
    ]
    assert known.asked[-1] == ("spike-threshold", SensorConfig(params={"sigma_3": 1.2}))
    names = [name for name, _, _ in Space(agent="stopping-zone").shifts()]
    assert names.count("deceleration") == names.count("reaction") == names.count("ground") == 2


class Eye:
    """Ground that likes a tele lens and a neuron with sigma_3 near 1.5."""

    def score(self, agent, sensor_config):
        away = abs(sensor_config.params["sigma_3"] - 1.5)
        return tuning_ground.Score(0.5 * (sensor_config.camera == "tele") - 0.3 * away, 0.0, 10, 10)


def test_lens_and_neuron_are_searched_on_demand(tmp_path):
    pytest.importorskip("optuna")
    space = Space(agent="spike-threshold", cameras=("fovea", "tele"), neuron=("sigma_3",))
    found = tuning.tune(space, tmp_path / "study.db", 30, Eye(), Eye(), tell=lambda line: None)
    assert found["camera"] == "tele"
    assert abs(found["neuron.sigma_3"] - 1.5) < 0.3
    assert spelled("spike-threshold", found).startswith("spike-threshold:threshold=")
    assert "neuron" not in spelled("spike-threshold", found)
    assert sensor_config(found).camera == "tele"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"agent": "nested-fild"}, "unknown rule 'nested-fild'; did you mean 'nested-fields'"),
        ({"cameras": ("telle",)}, "unknown camera 'telle'; did you mean 'tele'"),
        ({"agent": "stopping-zone", "cameras": ("tele",)}, "needs the cameras of its own eye"),
        ({"neuron": ("sigma3",)}, "unknown number of the neuron 'sigma3'; did you mean 'sigma_3'"),
        (
            {"neuron": ("t_ffi",)},
            "unknown number of the neuron 't_ffi'",
        ),  # infinite: neither halved nor doubled
    ],
)
def test_what_cannot_be_searched_is_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        Space(**({"agent": "spike-threshold"} | changes))


def test_what_is_found_is_what_the_benchmark_takes(tmp_path, monkeypatch, capsys):
    pytest.importorskip("optuna")
    monkeypatch.chdir(tmp_path)
    common = ["--levels", "2", "--seeds", "0", "--trials", "2", "--jobs", "1"]
    searched_too = ["--agent", "spike-threshold", "--cameras", "tele", "fovea", "--neuron", "sigma_3"]
    assert cli.run(["tune", *common, *searched_too]) == 0
    told = capsys.readouterr().out.splitlines()[-1].split(": ", 1)[1].split()
    assert told[0] == "--agents"
    assert "--params" in told
    assert cli.run(["bench", *told, "--suite", "r152", "--seeds", "1", "--jobs", "1"]) == 0
    assert cli.run(["tune", *common, *searched_too]) == 2
    assert "'best.toml' exists and is kept" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("agent", "levels", "seeds"),
    [
        ("spike-threshold:threshold=60", 8, 0),
        ("frame-difference:level=2", 8, 0),
        pytest.param("stopping-zone", 20, 1, marks=pytest.mark.slow),
    ],
)
def test_a_recorded_drive_tells_what_the_closed_loop_does(agent, levels, seeds):
    ground, made = tuning_ground.Ground("train", levels, seeds), make_agent(agent)
    ground.score("no-brake")
    ground.score("spike-threshold")  # an eye before this one leaves nothing behind
    assert tuning_ground.latches(made)
    open_loop = ground.score(agent)
    rows = ground._closed_loop(agent, SensorConfig().for_agent(made))
    assert open_loop == tuning_ground.Score.of(rows)
    assert open_loop.threats
    assert open_loop.quiet
    found = [tuning_ground.onset(made, drive) for drive in ground._seen_through(SensorConfig().for_agent(made))]
    assert {index is None for index in found} == {True, False}  # it brakes in some and not in all
    for key, row in zip(enumerate(found), rows, strict=True):
        recorded = ground._outcomes[key]
        assert all(
            recorded[name] == row[name]
            for name in ("collision", "relative_impact_speed", "ttc_at_brake", "duration", "episode_return")
        )


def test_the_last_eyes_are_kept(monkeypatch):
    ground, recorded = tuning_ground.Ground("train", 1, 0), []
    monkeypatch.setattr(tuning_ground, "record", lambda *place: recorded.append(place[-1]) or recorded[-1])
    sensors = [SensorConfig(camera=name) for name in ("wide", "tele", "fovea", "standard", "paper")]
    for eye in (*sensors[:4], sensors[0], sensors[4], sensors[0], sensors[1]):
        assert ground._seen_through(eye)[0].camera[0]["name"] == eye.camera
    assert len(recorded) == 6  # the four, the fifth, and the second anew, which was dropped for it


def test_what_eases_off_is_played_out():
    assert not tuning_ground.latches(make_agent("graded"))
    assert not tuning_ground.latches(make_agent("ttc-oracle"))


def test_what_places_the_cameras_is_searched_on_demand():
    placing, rule = {"deceleration", "reaction"}, tunable("stopping-zone")
    assert placing.isdisjoint(searched(rule))
    assert placing < set(searched(rule, placing=True))
    assert "ground" in searched(rule)
    assert searched(tunable("spike-threshold")) == ["threshold", "frames"]


@pytest.mark.slow
def test_a_ground_scores_the_bounds():
    ground = tuning_ground.Ground("train", 12, 0)
    never, always = ground.score("no-brake"), ground.score("always-brake")
    assert never.threats + never.quiet == 12
    assert (never.avoided_energy, never.false_rate) == (0.0, 0.0)
    assert always.false_rate == 1.0
