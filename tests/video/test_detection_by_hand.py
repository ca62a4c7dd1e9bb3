"""Onsets and detections of clips: every expected value is computed by hand."""

from math import exp, isnan

import numpy as np
import pytest

from lgmd_gym.clips.detection import ChanceLevel, detect, find_onsets, summarize_detections
from lgmd_gym.statistics.intervals import Rate, poisson_interval


def alarm_at(frames, *numbers):
    alarm = np.zeros(frames, bool)
    alarm[list(numbers)] = True
    return alarm


@pytest.mark.parametrize(
    ("alarms", "fps", "onsets"),
    [
        ((10, 20), 30.0, [10]),  # 9 frames of silence are too few
        ((10, 21), 30.0, [10, 21]),  # a third of a second at 30 Hz is 10 frames
        ((10, 16), 30.0, [10]),
        ((9,), 30.0, []),  # an alarm in the first third of a second is not an onset
        ((5, 11), 15.0, [5, 11]),  # 5 frames at 15 Hz
        ((5, 10), 15.0, [5]),
        ((1, 3), 1.0, [1, 3]),  # at least one frame
    ],
)
def test_onset_follows_a_third_of_a_second_of_silence(alarms, fps, onsets):
    assert find_onsets(alarm_at(30, *alarms), fps).tolist() == onsets


def test_chance_level():
    level = ChanceLevel.of(2, 30.0)
    low, high = poisson_interval(2)
    expected = [1 - exp(-count * 1.5 / 30) for count in (2, low, high)]
    assert level == (2, 30.0, *map(pytest.approx, expected))
    assert isnan(ChanceLevel.of(2, 0.0).probability)
    assert ChanceLevel.of(2, 0.0)[3:] == (0.0, 1.0)


@pytest.mark.parametrize(
    ("alarm", "lead", "earlier"),
    [
        # The crash is at frame 90, its window the 45 frames before.
        (44, None, 1),
        (45, 45 / 30, 0),
        (89, 1 / 30, 0),
        (90, None, 0),
    ],
)
def test_window_before_the_crash(alarm, lead, earlier):
    frequency = np.arange(100.0)
    found = detect("clip", frequency, alarm_at(100, alarm), 30.0, 3.0)
    assert (found.lead_s, found.chance.onsets) == (lead, earlier)
    # The filters settle in 8 frames; the earlier part ends at frame 45.
    assert (found.chance.seconds, found.peak) == (pytest.approx(37 / 30), 99.0)
    assert found.alarm_frames == Rate.of([True] * earlier + [False] * (37 - earlier))


def test_clip_without_a_crash_is_all_earlier():
    found = detect("clip", np.arange(100.0)[::-1], alarm_at(100, 20, 60), 30.0, None)
    assert (found.lead_s, found.chance.onsets, found.chance.seconds) == (None, 2, pytest.approx(92 / 30))
    assert (found.alarm_frames[:2], found.peak) == ((2, 92), 91.0)


def test_summary_of_detections():
    clips = [
        detect("hit", np.zeros(100), alarm_at(100, 60), 30.0, 3.0),
        detect("early", np.zeros(100), alarm_at(100, 30), 30.0, 3.0),
        detect("quiet", np.zeros(100), alarm_at(100), 30.0, None),
    ]
    found = summarize_detections(clips)
    assert (found.hits[:2], found.silent_clips[:2], found.lead_s) == ((1, 2), (1, 1), 1.0)
    assert (found.chance.onsets, found.chance.seconds) == (1, pytest.approx((37 + 37 + 92) / 30))
    assert found.alarm_frames[:2] == (1, 37 + 37 + 92)
    # At least one hit of two, each with the upper bound of the chance level.
    assert found.p_value == pytest.approx(1 - (1 - found.chance.high) ** 2)
