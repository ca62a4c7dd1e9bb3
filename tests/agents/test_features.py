"""What policies are shown of an observation: scaled, remembered, sorted by own speed."""

import numpy as np
import pytest

from lgmd_gym.agents.policies.features import FADE, LIMIT, FeatureConfig, FeatureHistory, shrink_frame
from lgmd_gym.agents.policies.zone_memory import ZONED
from lgmd_gym.agents.stopping_zone import SPEEDS_KMH


def observed(value):
    return {"spike_frequency": np.array([value], np.float32), "ego_speed": np.array([10.0], np.float32)}


def seen(memory, *observations):
    """See some observations, then tell once."""
    for observation in observations:
        memory.update(observation)
    return memory.stack()


def test_memory_scales_and_remembers():
    memory = FeatureHistory(FeatureConfig(inputs=("spike_frequency", "ego_speed"), history=3))
    first = seen(memory, observed(50.0))
    assert first["spike_frequency"].tolist() == [0.5, 0.5, 0.5]
    assert first["ego_speed"].tolist() == [0.5, 0.5, 0.5]
    seen(memory, observed(100.0))
    assert seen(memory, observed(9e9))["spike_frequency"].tolist() == [0.5, 1.0, LIMIT]
    memory.reset()
    assert seen(memory, observed(0.0))["spike_frequency"].tolist() == [0.0, 0.0, 0.0]


def test_memory_derives_braking_and_fading_peaks():
    """Peaks fade with every observation, speed changes from one telling to the next."""
    memory = FeatureHistory(FeatureConfig(inputs=("spike_peak", "speed_change"), history=1))

    def given(frequency, speed):
        return {"spike_frequency": np.array([frequency], np.float32), "ego_speed": np.array([speed])}

    told = [
        seen(memory, given(0, 10.0)),
        seen(memory, given(200, 9.7), given(0, 9.5)),
        seen(memory, given(0, 9.0), given(0, 8.6)),
    ]
    assert [float(item["spike_peak"][0]) for item in told] == pytest.approx([0.0, 2 * FADE, 2 * FADE**3])
    assert [float(item["speed_change"][0]) for item in told] == pytest.approx([0.0, -0.5, -0.9])


def zone_eye(fields, speed=10.0, yaw_rate=0.0):
    """An observation of the eye of `stopping-zone`: excitations as {(speed of the zone [km/h], pair): k}."""
    k = np.zeros(20)
    for (zone, pair), value in fields.items():
        k[SPEEDS_KMH.index(zone) + 10 * ("ground", "upright").index(pair)] = value
    return {
        "membrane_potential": 1 / (1 + np.exp(-k)),
        "spike_frequency": 10.0 * k,
        "ffi": k,
        "ego_speed": np.array([speed], np.float32),
        "ego_yaw_rate": np.array([yaw_rate], np.float32),
    }


SEEN = {
    (40, "ground"): 3.0,  # the zone of 10 m/s
    (40, "upright"): 1.5,
    (50, "ground"): 6.0,  # the next one farther
    (30, "upright"): 9.0,  # a nearer one whose ground field is silent
    (25, "ground"): 0.9,  # a nearer one: the weaker of the two counts
    (25, "upright"): 1.2,
    (10, "ground"): 9.0,  # made for less than half of 10 m/s: does not count
    (10, "upright"): 9.0,
}


def zones_of(memory, *observations, name="zones"):
    """What stood in two frames (the fifth value once more in four), and the peaks, before tanh."""
    scale = ZONED[name][1]
    told = scale * np.arctanh(seen(memory, *observations)[name].astype(np.float64))
    return told[:6].round(2).tolist(), told[6:].round(2).tolist()


@pytest.mark.parametrize("name", ZONED)
def test_zones_are_sorted_by_own_speed(name):
    memory = FeatureHistory(FeatureConfig(inputs=(name,), history=1))
    factor = 10.0 if name == "zones_spikes" else 1.0
    around = np.array([3.0, 1.5, 6.0, 0.0, 0.9]) * factor
    held, peak = zones_of(memory, zone_eye(SEEN), name=name)
    assert held == pytest.approx([*around, around[-1]], abs=0.01)  # nothing is known before the first frame
    assert peak == pytest.approx(around.tolist(), abs=0.01)
    fastest = FeatureHistory(FeatureConfig(inputs=(name,), history=1))
    held, _ = zones_of(fastest, zone_eye({(90, "ground"): 3.0}, speed=40.0), name=name)
    assert held[:4] == pytest.approx([3.0 * factor, 0.0, 3.0 * factor, 0.0], abs=0.01)  # none is farther


def test_zones_tell_what_stood_and_what_was():
    memory = FeatureHistory(FeatureConfig(inputs=("zones",), history=1))
    quiet, here = zone_eye({}), zone_eye({(40, "ground"): 3.0})
    near = zone_eye({(30, "ground"): 2.0, (30, "upright"): 4.0})
    assert zones_of(memory, quiet) == ([0.0] * 6, [0.0] * 5)
    held, peak = zones_of(memory, here, quiet, quiet)  # one frame is no sight, but leaves a peak
    assert held == [0.0] * 6
    assert peak[0] == pytest.approx(3.0 * FADE**2, abs=0.01)
    held, _ = zones_of(memory, here, here, quiet)  # two frames are, also if they are over
    assert held == pytest.approx([3.0, 0, 0, 0, 0, 0], abs=0.01)
    assert zones_of(memory, quiet)[0] == [0.0] * 6  # told once
    assert zones_of(memory, near, near, near)[0] == pytest.approx([0, 0, 0, 0, 2.0, 0], abs=0.01)
    assert zones_of(memory, near)[0] == pytest.approx([0, 0, 0, 0, 2.0, 2.0], abs=0.01)


def test_zones_are_silent_while_the_car_turns_and_forget():
    memory = FeatureHistory(FeatureConfig(inputs=("zones",), history=1))
    there = {(40, "ground"): 3.0}
    assert zones_of(memory, zone_eye(there, yaw_rate=0.02))[1][0] == pytest.approx(3.0, abs=0.01)
    silent = ([0.0] * 6, [0.0] * 5)
    assert zones_of(memory, zone_eye(there, yaw_rate=-0.04)) == silent
    assert zones_of(memory, *[zone_eye(there)] * 14) == silent  # half a second
    assert zones_of(memory, *[zone_eye(there)] * 2)[0][0] == pytest.approx(3.0, abs=0.01)


def test_zones_are_silent_at_a_crawl():
    memory = FeatureHistory(FeatureConfig(inputs=("zones",), history=1))
    there = {(10, "ground"): 3.0, (10, "upright"): 3.0}
    assert zones_of(memory, *[zone_eye(there, speed=2.4)] * 3) == ([0.0] * 6, [0.0] * 5)
    assert zones_of(memory, *[zone_eye(there, speed=2.6)] * 2)[0][0] == pytest.approx(3.0, abs=0.01)


def test_zones_need_their_eye():
    given = observed(1.0) | {"membrane_potential": np.array([0.5, 0.6]), "ego_yaw_rate": np.zeros(1)}
    with pytest.raises(ValueError, match="needs the eye of stopping-zone with 20 cameras, got 2; train with"):
        FeatureHistory(FeatureConfig(inputs=("zones",))).update(given)


def test_frames_shrink_to_means():
    frame = np.zeros((4, 6, 1), np.uint8)
    frame[:2, 2:4] = 100
    small = shrink_frame(frame, 2)
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
        FeatureConfig.from_dict(values)
