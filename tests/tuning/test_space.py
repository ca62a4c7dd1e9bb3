"""Search spaces: what is searched, and what is rejected."""

import pytest

from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.tuning.space import SearchSpace, agent_string, sensor_config


def test_camera_geometry_is_searched_on_request():
    fixed = set(SearchSpace(agent="stopping-zone").defaults())
    assert set(SearchSpace(agent="stopping-zone", camera_geometry=True).defaults()) - fixed == {
        "deceleration",
        "reaction",
    }
    assert "ground" in fixed
    assert SearchSpace(agent="spike-threshold").defaults() == {"threshold": 30.0, "frames": 1}


def test_a_proposal_becomes_an_agent_string_and_a_sensor_configuration():
    proposal = {"threshold": 45.0, "frames": 2, "camera": "tele", "neuron.sigma_3": 1.2}
    assert agent_string("spike-threshold", proposal) == "spike-threshold:threshold=45.0,frames=2"
    assert sensor_config(proposal) == SensorConfig("tele", {"sigma_3": 1.2})
    assert agent_string("spike-threshold", {}) == "spike-threshold"
    assert sensor_config({}) == SensorConfig()


def test_shifts_change_one_parameter_at_a_time_by_a_fifth():
    shifts = SearchSpace(agent="spike-threshold", neuron=("sigma_3",)).shifts()
    assert [(name, value) for name, value, _ in shifts] == [
        ("threshold", 24.0),
        ("threshold", 36.0),
        ("frames", 1),
        ("frames", 2),
        ("neuron.sigma_3", 0.8),
        ("neuron.sigma_3", 1.2),
    ]
    assert [proposal for _, _, proposal in shifts] == [{name: value} for name, value, _ in shifts]


def test_shifts_include_the_camera_geometry_but_not_the_camera_preset():
    names = [name for name, _, _ in SearchSpace(agent="stopping-zone").shifts()]
    assert names.count("deceleration") == names.count("reaction") == names.count("ground") == 2
    names = [name for name, _, _ in SearchSpace(agent="spike-threshold", cameras=("tele",)).shifts()]
    assert "camera" not in names


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"agent": "stoping-zone"}, "unknown rule 'stoping-zone'; did you mean 'stopping-zone'"),
        ({"agent": "no-brake"}, "unknown rule 'no-brake'"),
        ({"cameras": ("telle",)}, "unknown camera 'telle'; did you mean 'tele'"),
        ({"agent": "stopping-zone", "cameras": ("tele",)}, "has several cameras of its own, got cameras"),
        ({"neuron": ("sigma3",)}, "unknown neuron parameter 'sigma3'; did you mean 'sigma_3'"),
        ({"neuron": ("t_ffi",)}, "unknown neuron parameter 't_ffi'"),  # infinite: cannot be scaled
    ],
)
def test_an_invalid_space_is_rejected(changes, message):
    with pytest.raises(ValueError, match=message):
        SearchSpace(**({"agent": "spike-threshold"} | changes))
