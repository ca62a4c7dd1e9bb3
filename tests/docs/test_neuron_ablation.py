"""The script docs/experiments/neuron_ablation.py: inputs by value, and a run with a tiny budget."""

import gymnasium as gym
import numpy as np
import pytest
from support.examples import load

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.sides import NUM_COLUMNS
from lgmd_gym.neuron import LGMDParams, make
from lgmd_gym.sensing.sensor_array import SensorArray
from lgmd_gym.training.offline.dataset import mirror_input, policy_inputs
from lgmd_gym.training.offline.episodes import RecordedEpisode

pytest.importorskip("stable_baselines3")

MOTION = ("ego_speed", "ego_yaw_rate", "known_deceleration")
NAMES = ("lgmd", "lgmd sides", "dsn sides", "edges sides")  # the order of `column_potential` of all-round


@pytest.fixture(scope="module")
def script():
    return load("neuron_ablation")


def episode(length, seed, threat, **observations):
    """Return a recording in which braking at once pays 1 for a threat, and costs 1 otherwise."""
    sign = 1.0 if threat else -1.0
    motion = {name: np.ones((length, 1), np.float32) for name in MOTION}
    returns = np.linspace(sign, 0.0, length, dtype=np.float32)
    contacts = (np.arange(length) > length // 2) & threat
    rewards = np.full(length, -sign / length, np.float32)
    return RecordedEpisode(motion | observations, rewards, returns, contacts, threat)


def test_inputs_are_those_of_the_policy(script):
    """Features of columns, their history and their mirror image, up to the rounding of float16."""
    rng = np.random.default_rng(4)
    potential = rng.uniform(0.5, 1.0, (9, NUM_COLUMNS)).astype(np.float32)
    features = FeatureConfig(inputs=("columns",), history=1, repeat=2)
    (expected,) = policy_inputs([{"column_potential": potential}], features)
    levels = script.logarithmic(script.excitation(potential), 2.0).astype(np.float16)
    sizes = [len(script.mirror_of([name])[0]) // 4 for name in NAMES]
    parts = dict(zip(NAMES, np.split(levels, np.cumsum(sizes)[:-1], axis=1), strict=True))
    dataset = script.FieldDataset([episode(9, 0, True, **parts)], NAMES)
    for mirrored in (False, True):
        (found,) = dataset.batch([0], [mirrored])[0]["columns"].split(5)
        columns = mirror_input("columns", expected["columns"]) if mirrored else expected["columns"]
        assert np.allclose(found.numpy(), columns.astype(np.float32), atol=2e-3)


def test_pixels_are_linear(script):
    """The grey of a column, of which 64 levels are 1; the first frame counts as well."""
    detector = make(script.DETECTORS["pixels"], (2, 20), 30.0, columns=10)
    detector.step(np.repeat(np.arange(0, 200, 10), 2).reshape(20, 2).T.astype(np.uint8))
    grey = 16.0 * script.excitation(detector.column_potentials(10)) + 128.0
    assert np.allclose(grey, np.arange(5, 200, 20), atol=0.1)


def test_each_lens_is_drawn_once(script):
    """Six detectors share the ground, upright and low fields; three the near, middle and far pairs."""
    sensors = SensorArray(script.cameras(), 30.0, LGMDParams())
    assert len(sensors.names) == 6 * 17 + 3 * 6
    assert [len(group.frames[0]) for group in sensors._drawing.groups] == [7, 7, 3, 2, 2, 2]


def test_world_of_a_level(script):
    env = gym.make("LGMD/RandomBraking-v0", split="validation", camera={"name": "wide", "shape": (8, 8)})
    worlds = [env.reset(seed=seed)[1]["world"] for seed in (10_000, 310_001)]
    assert [script.world_of("validation", seed) for seed in (10_000, 310_001)] == worlds


def test_differences_are_paired(script):
    """Two trainings; an arm returns 0.5 more in each level, avoids one threat more, and brakes as often."""
    threats, worlds = np.array([True, True, False]), np.array([6000, 6001, 6001])
    returns, brakes = np.array([1.0, -3.0, 0.0]), np.array([True, True, False])
    reference = [script.Outcomes(returns + seed, brakes, np.array([True, False, False])) for seed in (0, 1)]
    found = [item._replace(returns=item.returns + 0.5, contacts=np.full(3, False)) for item in reference]
    first, report = (
        script.report_of(script.Arm(name, ()), item, reference, threats, worlds)
        for name, item in (("a", reference), ("|b|", found))
    )
    assert first.means == pytest.approx((-1.0 / 6.0, 0.5, 0.0))
    assert report.means == pytest.approx((1.0 / 3.0, 1.0, 0.0))
    assert [item[:3] for item in report.differences] == [(0.5, 0.5, 0.5), (0.5, 0.0, 1.0), (0.0, 0.0, 0.0)]
    head, _, *rows = script.table("forward", [first, report]).splitlines()
    assert head.endswith("| return against a | avoided | false activations |")
    assert rows == [
        "| a | −0.17 | 50.0 | 0.0 | – | – | – |",
        r"| \|b\| | 0.33 | 100.0 | 0.0 | +0.50 [+0.50, +0.50] | +50.0 [+0.0, +100.0] | +0.0 [+0.0, +0.0] |",
    ]


def test_network_learns_from_its_columns(script):
    """Columns are excited in threats only: the network brakes there at once, and in no other level."""
    rng = np.random.default_rng(0)
    episodes = [
        episode(8, seed, seed % 2 == 0, lgmd=(rng.random((8, 170)) * (seed % 2 == 0)).astype(np.float16))
        for seed in range(64)
    ]
    dataset = script.FieldDataset(episodes, ("lgmd",))
    found = script.outcomes(script.train(dataset, dataset, 0, 8), dataset)
    assert found.brakes.tolist() == [seed % 2 == 0 for seed in range(64)]
    assert not found.contacts.any()
    assert found.returns.mean() > 0.9


@pytest.mark.slow
def test_run(script, tmp_path, capsys):
    """The second run reads recordings and results."""
    arguments = [str(tmp_path), "--levels", "6", "--validation", "12", "--seeds", "1", "--epochs", "1"]
    first = script.main(arguments)
    lines = capsys.readouterr().out.splitlines()
    assert "6 training levels, 6 of selection; results on " in "\n".join(lines)
    assert {group: len(arms) for group, arms in first.items()} == {"forward": 6, "sides": 5, "fields": 4}
    assert sum(line.startswith("| lgmd, spike frequency |") for line in lines) == 1
    again = script.main(arguments)
    assert [report.means for group in again.values() for report in group] == [
        report.means for group in first.values() for report in group
    ]
    assert "seed 0" not in capsys.readouterr().out
