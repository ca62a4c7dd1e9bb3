"""Tuning: what a trial is scored on, what validation chooses, and that a study goes on."""

import pytest

from lgmd_gym import tuning, tuning_ground
from lgmd_gym.agents import make_agent


class Known:
    """Ground on which the score is known: best at threshold 100."""

    def __init__(self):
        self.asked = []

    def score(self, agent):
        self.asked.append(agent)
        threshold = make_agent(agent).params.threshold
        return tuning_ground.Score(1.0 - abs(threshold - 100.0) / 300.0, 0.0, 10, 10)


def test_a_study_finds_the_top_and_goes_on(tmp_path):
    pytest.importorskip("optuna")
    study, told = tmp_path / "study.db", []
    train = Known()
    tuning.tune("spike-threshold", study, 3, train, Known(), tell=told.append)
    assert len(train.asked) == 3
    assert "threshold=30.0" in train.asked[0]  # the defaults come first
    found = tuning.tune("spike-threshold", study, 20, train, Known(), tell=told.append)
    assert len(train.asked) == 23
    assert any(line.startswith("trial 22:") for line in told)
    assert abs(found["threshold"] - 100.0) < 35.0
    make_agent(tuning.spelled("spike-threshold", found))


def test_sensitivity_moves_one_parameter_at_a_time():
    rows = tuning.sensitivity("spike-threshold", Known())
    assert [(name, value) for name, value, _ in rows] == [
        ("threshold", pytest.approx(24.0)),
        ("threshold", pytest.approx(36.0)),
        ("frames", 1),
        ("frames", 2),
    ]


def test_only_rules_are_tuned():
    with pytest.raises(ValueError, match="unknown rule 'fova'; did you mean 'fovea'"):
        tuning.tunable("fova")


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
    rows = ground._closed_loop(agent, made)
    assert open_loop == tuning_ground.Score.of(rows)
    assert open_loop.threats
    assert open_loop.quiet
    found = [tuning_ground.onset(made, drive) for drive in ground._drives]
    assert {index is None for index in found} == {True, False}  # it brakes in some and not in all
    for key, row in zip(enumerate(found), rows, strict=True):
        recorded = ground._outcomes[key]
        assert all(
            recorded[name] == row[name]
            for name in ("collision", "relative_impact_speed", "ttc_at_brake", "duration", "episode_return")
        )


def test_what_eases_off_is_played_out():
    assert not tuning_ground.latches(make_agent("graded"))
    assert not tuning_ground.latches(make_agent("ttc-oracle"))


def test_what_places_the_cameras_is_not_searched():
    assert {"deceleration", "reaction"}.isdisjoint(tuning.searched(tuning.tunable("stopping-zone")))
    assert "ground" in tuning.searched(tuning.tunable("stopping-zone"))
    assert tuning.searched(tuning.tunable("spike-threshold")) == ["threshold", "frames"]


@pytest.mark.slow
def test_a_ground_scores_the_bounds():
    ground = tuning_ground.Ground("train", 12, 0)
    never, always = ground.score("no-brake"), ground.score("always-brake")
    assert never.threats + never.quiet == 12
    assert (never.avoided_energy, never.false_rate) == (0.0, 0.0)
    assert always.false_rate == 1.0
