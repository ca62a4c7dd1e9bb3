"""What policies are shown of an observation: scaled, remembered, sorted by own speed."""

import numpy as np
import pytest

from lgmd_gym.agents.features import FADE, LIMIT, Features, Memory, shrunk


def observed(value):
    return {"spike_frequency": np.array([value], np.float32), "ego_speed": np.array([10.0], np.float32)}


def test_memory_scales_and_remembers():
    memory = Memory(Features(inputs=("spike_frequency", "ego_speed"), history=3))
    first = memory.see(observed(50.0))
    assert first["spike_frequency"].tolist() == [0.5, 0.5, 0.5]
    assert first["ego_speed"].tolist() == [0.5, 0.5, 0.5]
    memory.see(observed(100.0))
    assert memory.see(observed(9e9))["spike_frequency"].tolist() == [0.5, 1.0, LIMIT]
    memory.clear()
    assert memory.see(observed(0.0))["spike_frequency"].tolist() == [0.0, 0.0, 0.0]


def test_memory_derives_braking_and_fading_peaks():
    memory = Memory(Features(inputs=("spike_peak", "speed_change"), history=1))
    told = []
    for frequency, speed in ((0, 10.0), (200, 9.5), (0, 8.6)):
        given = {"spike_frequency": np.array([frequency], np.float32), "ego_speed": np.array([speed])}
        told.append(memory.see(given))
    assert [float(item["spike_peak"][0]) for item in told] == pytest.approx([0.0, 2.0, 2.0 * FADE])
    assert [float(item["speed_change"][0]) for item in told] == pytest.approx([0.0, -0.5, -0.9])


def zone_eye(ground, upright, speed):
    """An observation of the eye of `stopping-zone`, from excitations of the 10 ground and upright fields."""
    k = np.concatenate([ground, upright])
    return {
        "membrane_potential": (1 / (1 + np.exp(-k))).astype(np.float64),
        "ffi": np.arange(20.0),
        "ego_speed": np.array([speed], np.float32),
    }


def test_zones_are_sorted_by_own_speed_and_their_peaks_fade():
    ground, upright = np.zeros(10), np.zeros(10)
    ground[4], upright[4] = 3.0, 1.5  # the zone of 40 km/h
    ground[5], upright[2] = 6.0, 9.0  # the next one; a nearer one, of which the weaker field counts: none
    ground[1], upright[1] = 0.9, 1.2
    memory = Memory(Features(inputs=("zones", "zones_peak", "zones_ffi"), history=1))
    shown = memory.see(zone_eye(ground, upright, 10.0))
    assert shown["zones"] == pytest.approx([1.0, 0.5, 2.0, 0.0, 0.3], abs=1e-5)
    assert shown["zones_ffi"] == pytest.approx([0.2, 0.7, 0.25, 0.75, 0.15])
    shown = memory.see(zone_eye(np.zeros(10), np.zeros(10), 10.0))
    assert shown["zones"] == pytest.approx([0.0] * 5, abs=1e-5)
    assert shown["zones_peak"] == pytest.approx([FADE, FADE * 0.5, FADE * 2, 0.0, FADE * 0.3], abs=1e-5)
    fastest = Memory(Features(inputs=("zones",), history=1)).see(zone_eye(ground, upright, 40.0))
    assert fastest["zones"][0] == fastest["zones"][2] == 0.0  # no zone is farther than the last


def test_zones_need_their_eye():
    given = observed(1.0) | {"membrane_potential": np.array([0.5, 0.6])}
    with pytest.raises(ValueError, match="needs the eye of stopping-zone with 20 cameras, got 2; train with"):
        Memory(Features(inputs=("zones",))).see(given)


def test_frames_shrink_to_means():
    frame = np.zeros((4, 6, 1), np.uint8)
    frame[:2, 2:4] = 100
    small = shrunk(frame, 2)
    assert small.shape == (2, 3, 1)
    assert small[0, 1, 0] == 100
    assert small.sum() == 100


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (
            {"inputs": ["spike_frequncy"]},
            "unknown policy input 'spike_frequncy'; did you mean 'spike_frequency'",
        ),
        ({"inputs": []}, "inputs needs at least one observation key"),
        ({"histry": 3}, "unknown policy feature 'histry'; did you mean 'history'"),
        ({"history": 0}, "history must be a whole number >= 1, got 0"),
        ({"latch": 1}, "latch must be true or false, got 1"),
        ({"reward_scale": 0.0}, "reward_scale must be"),
    ],
)
def test_bad_features_are_refused(values, words):
    with pytest.raises(ValueError, match=words):
        Features.from_dict(values)
