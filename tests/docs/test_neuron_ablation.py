"""The script docs/experiments/neuron_ablation.py: inputs by value, and a run with a tiny budget."""

import re
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.examples import load

import lgmd_gym
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.sides import NUM_COLUMNS, NUM_FORWARD_COLUMNS, NUM_FORWARD_FIELDS, NUM_SIDE_FIELDS
from lgmd_gym.neuron import LGMDParams, make
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.training.offline.dataset import mirror_input, policy_inputs
from lgmd_gym.training.offline.episodes import DrivenEpisode

pytest.importorskip("stable_baselines3")

NAMES = ("dsn", "dsn sides", "edges sides")  # the order of `column_potential` of all-round


@pytest.fixture(scope="module")
def script():
    return load("neuron_ablation")


def episode(script, length, threat, **observations):
    """Return a level without braking; the last moment of a threat is one decision before its end."""
    motion = {name: np.ones((length, 1), np.float32) for name in script.MOTION}
    times = np.maximum(np.arange(length - 2, -2, -1), 0) / 30.0 if threat else np.full(length, np.inf)
    demands = np.zeros(length, np.float32)
    return DrivenEpisode(motion | observations, times.astype(np.float32), demands, threat)


def test_inputs_are_those_of_the_policy(script):
    """Features of columns, their history and their mirror image, up to the rounding of float16."""
    rng = np.random.default_rng(4)
    potential = rng.uniform(0.2, 0.95, (9, NUM_COLUMNS)).astype(np.float32)
    features = FeatureConfig(inputs=("columns", *script.MOTION), history=1, repeat=2)
    levels = script.logarithmic(script.excitation(potential), 2.0).astype(np.float16)
    sizes = [len(script.mirror_of([name])[0]) // 4 for name in NAMES]
    parts = dict(zip(NAMES, np.split(levels, np.cumsum(sizes)[:-1], axis=1), strict=True))
    recorded = episode(script, 9, True, **parts)
    (expected,) = policy_inputs([recorded.observations | {"column_potential": potential}], features)
    dataset = script.FieldDataset([recorded], NAMES)
    assert dataset.bounds.tolist() == [0, 5]
    assert dataset.names == sorted(features.inputs)
    for mirrored in (False, True):
        found = dataset.batch(np.arange(5), np.full(5, mirrored)).numpy()
        inputs = [expected[name] for name in dataset.names]
        if mirrored:
            inputs = [mirror_input(name, expected[name]) for name in dataset.names]
        assert np.allclose(found, np.concatenate(inputs, axis=1), atol=2e-3)
    assert dataset.classes.tolist() == [0] * 5  # below 0.3 s


def test_pixels_are_linear(script):
    """The grey of a column, of which 64 levels are 1; the first frame counts as well."""
    detector = make(script.DETECTORS["pixels"], (2, 20), 30.0, columns=10)
    detector.step(np.repeat(np.arange(0, 200, 10), 2).reshape(20, 2).T.astype(np.uint8))
    grey = 16.0 * script.excitation(detector.column_potentials(10)) + 128.0
    assert np.allclose(grey, np.arange(5, 200, 20), atol=0.1)


def test_each_lens_is_drawn_once(script):
    """Six detectors share the ground, upright and low fields; three the near, middle and far pairs."""
    sensors = SensorArray(script.cameras(), 30.0, LGMDParams())
    assert len(sensors.names) == 6 * NUM_FORWARD_FIELDS + 3 * NUM_SIDE_FIELDS
    assert [len(group.frames[0]) for group in sensors._drawing.groups] == [5, 5, 3, 2, 2, 2]
    assert sensors.names[-NUM_SIDE_FIELDS:] == [f"{name}_edges" for name in side_names()]
    assert sensors.names[-3 * NUM_SIDE_FIELDS :][:NUM_SIDE_FIELDS] == [
        f"{name}_lgmd" for name in side_names()
    ]


def side_names():
    return [f"{name}_{side}" for name in ("near", "middle", "far") for side in ("left", "right")]


def test_levels_of_detectors_are_at_their_places(script):
    """Each column and field of a channel has the level of its own response."""
    size, fields = NUM_FORWARD_COLUMNS, NUM_FORWARD_FIELDS
    rng = np.random.default_rng(0)
    columns = rng.uniform(0.5, 0.9, (2, 6 * size + 3 * 30)).astype(np.float32)
    ffi = rng.uniform(0.0, 9.0, (2, 6 * fields + 18)).astype(np.float32)
    signals = {name: np.ones((2, 1), np.float32) for name in script.MOTION}
    signals |= {"column_potential": columns, "ffi": ffi, "membrane_potential": 0.5 + ffi / 20.0}
    levels = script.levels_of(signals | {"spike_frequency": ffi})
    potential = script.logarithmic(script.excitation(columns), 2.0)
    assert np.allclose(levels["off-only"], potential[:, size : 2 * size], atol=1e-3)
    assert np.allclose(levels["dsn sides"], potential[:, 6 * size + 30 : 6 * size + 60], atol=1e-3)
    expected = script.logarithmic(ffi[:, 6 * fields + 6 : 6 * fields + 12], 2.0)
    assert np.allclose(levels["dsn ffi"], expected, atol=1e-3)
    expected = script.logarithmic(ffi[:, fields : 2 * fields], 0.1)
    assert np.allclose(levels["off-only spikes"], expected, atol=1e-3)
    assert np.allclose(levels["pixels"], script.excitation(columns[:, 5 * size : 6 * size]) / 4.0, atol=1e-3)


def test_sets_of_levels(script):
    """Shares and families of the shipped policy; threats and their twins have the same seeds."""
    numbers = np.array(
        [script.CONFIG.n_timesteps, *(int(text.split(":")[0]) for text in script.CONFIG.extra_levels)]
    )
    sets = script.level_sets("validation", numbers.sum() // 10)
    assert [len(seeds) for _, _, seeds in sets] == pytest.approx(numbers / 10, abs=1)
    assert {seeds.start for _, _, seeds in sets} == {10_000}
    assert sets[0][1] == []
    assert sets[3][1] == [f"{family}WithoutTarget" for family in sets[2][1]]


@pytest.mark.parametrize("name", ["env_kwargs", "families", "camera", "lgmd_gym"])
def test_levels_of_other_settings_are_not_used_again(script, tmp_path, monkeypatch, name):
    def record(self, seeds):
        return [[episode(script, 3, True)] for _ in seeds]

    monkeypatch.setattr(script.DriveRecorder, "record", record)
    monkeypatch.setattr(script, "with_levels", lambda item: item)
    script.record(tmp_path, "validation", 40)
    monkeypatch.setattr(script.DriveRecorder, "record", None)  # any recording raises
    script.record(tmp_path, "validation", 40)
    config = script.CONFIG
    if name == "env_kwargs":
        monkeypatch.setattr(script, "CONFIG", replace(config, env_kwargs={"world": 3}))
    elif name == "families":
        number, _ = config.extra_levels[0].split(":")
        extra_levels = (f"{number}:CCRs", *config.extra_levels[1:])
        monkeypatch.setattr(script, "CONFIG", replace(config, extra_levels=extra_levels))
    elif name == "camera":
        monkeypatch.setattr(script, "cameras", list)
    else:
        monkeypatch.setattr(lgmd_gym, "__version__", "0")
    with pytest.raises(ValueError, match=f"recorded with another {name} "):
        script.record(tmp_path, "validation", 40)


def test_results_belong_to_the_number_of_levels(script, tmp_path):
    script.results(tmp_path, ([0] * 5, [0] * 2, [0] * 3), ("lgmd",), 0, 1)
    assert [item.name for item in (tmp_path / "results").iterdir()] == ["5-levels-5-validation-1-epochs"]


def test_world_of_a_level(script):
    env = gym.make("LGMD/RandomBraking-v0", split="validation", camera={"name": "wide", "shape": (8, 8)})
    worlds = [env.reset(seed=seed)[1]["world"] for seed in (10_000, 310_001)]
    assert [script.world_of("validation", seed) for seed in (10_000, 310_001)] == worlds


def test_differences_are_paired(script):
    """Two trainings; an arm avoids one threat more and brakes as often in the level without a threat."""
    threats, worlds = np.array([True, True, False]), np.array([6000, 6001, 6001])
    reference = [script.Outcomes(seed + 0.0, seed + np.array([-1.0, 3.0, 2.0])) for seed in (0, 1)]
    found = [item._replace(scores=item.scores + np.array([1.5, 0.0, 0.0])) for item in reference]
    first, report = (
        script.report_of(name, item, reference, threats, worlds)
        for name, item in (("a", reference), ("|b|", found))
    )
    assert (first.means, first.area) == ((0.5, 1.0), 0.5)
    assert (report.means, report.area) == ((1.0, 1.0), 0.5)
    assert [item[:3] for item in report.differences] == [(0.5, 0.0, 1.0), (0.0, 0.0, 0.0)]
    head, _, *rows = script.table("forward", [first, report]).splitlines()
    assert head.endswith("| area | avoided against a | false activations |")
    assert rows == [
        "| a | 50.0 | 100.0 | 0.500 | – | – |",
        r"| \|b\| | 100.0 | 100.0 | 0.500 | +50.0 [+0.0, +100.0] | +0.0 [+0.0, +0.0] |",
    ]


def test_network_learns_from_its_columns(script):
    """Columns grow in threats only, and the scores of threats are above all others."""
    rng = np.random.default_rng(0)
    size = (60, NUM_FORWARD_COLUMNS)
    growth = np.linspace(0.0, 1.0, 60)[:, None]
    levels = [(growth * rng.random(size) * (seed % 2 == 0)).astype(np.float16) for seed in range(24)]
    episodes = [episode(script, 60, seed % 2 == 0, lgmd=item) for seed, item in enumerate(levels)]
    dataset = script.FieldDataset(episodes, ("lgmd",))
    scores = script.scores_of(script.train(dataset, dataset, 0, 20), dataset, episodes)
    assert scores[::2].min() > scores[1::2].max() + 1.0


def test_score_of_a_threat_ends_at_the_last_moment(script):
    """The odds rise with the speed: the last two decisions of ten are too late."""

    class Learner:
        brake = script.TimeToBrakeParams()

        def odds(self, dataset):
            speed = dataset.batch(np.arange(len(dataset))).numpy()[:, [-3]]
            return self.brake.odds(np.concatenate([speed, np.zeros((len(speed), 4))], axis=1))

    lgmd = np.zeros((20, NUM_FORWARD_COLUMNS), np.float16)
    episodes = [episode(script, 20, threat, lgmd=lgmd) for threat in (True, False)]
    for item in episodes:
        item.observations["ego_speed"][:] = np.arange(20)[:, None]
    dataset = script.FieldDataset(episodes, ("lgmd",))
    found = script.scores_of(Learner(), dataset, episodes)
    expected = [np.log(np.exp(speed / 20.0) + 1.0) - np.log(3.0) for speed in (16, 18)]
    assert found == pytest.approx(expected, abs=1e-3)


@pytest.mark.slow
def test_run(script, tmp_path, capsys):
    """The second run reads recordings and results."""
    arguments = [str(tmp_path), "--levels", "6", "--validation", "12", "--seeds", "1", "--epochs", "1"]
    first = script.main(arguments)
    lines = capsys.readouterr().out.splitlines()
    assert any(re.match(r"[4-8] training levels, [5-9] of selection; results on ", line) for line in lines)
    assert {group: len(arms) for group, arms in first.items()} == {"forward": 6, "sides": 5, "fields": 4}
    assert sum(line.startswith("| lgmd, spike frequency |") for line in lines) == 1
    again = script.main(arguments)
    assert [report.means for group in again.values() for report in group] == [
        report.means for group in first.values() for report in group
    ]
    assert "seed 0" not in capsys.readouterr().out
