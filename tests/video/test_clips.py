"""Tests of running the neuron on clips, clip summaries and the detection statistics."""

import os
from pathlib import Path

import numpy as np
import pytest
from support.clips import write_lossless

from lgmd_gym import LGMD, LGMDParams
from lgmd_gym.clips.detection import detect, find_onsets, summarize_detections
from lgmd_gym.clips.playback import (
    BINS,
    PLAYBACK_CONFIGS,
    ClipFrame,
    ClipRun,
    ClipSummary,
    DuplicateFilter,
    PlaybackConfig,
)
from lgmd_gym.clips.published import find_published
from lgmd_gym.clips.study import HEADLINE, read_traces
from lgmd_gym.neuron import Response

VIDEOS = Path(os.environ.get("LGMD_VIDEOS", Path(__file__).parents[3] / "shared" / "data" / "videos"))


def noisy(frame, rng, amplitude):
    noise = rng.integers(-amplitude, amplitude + 1, frame.shape)
    return np.clip(frame.astype(int) + noise, 0, 255).astype(np.uint8)


# Runs


def test_a_run_steps_the_neuron_on_every_frame(clip, looming):
    neuron = LGMD((48, 96), 30.0)
    expected = [neuron.step(frame) for frame in looming]
    frames = list(ClipRun(clip, PlaybackConfig()))
    assert [frame.response for frame in frames] == expected
    assert [frame.time for frame in frames] == pytest.approx(np.arange(60) / 30.0)
    assert max(response.spike_frequency for response in expected) > 30


def test_region_of_interest_and_parameters_are_those_of_the_neuron(clip):
    run = ClipRun(clip, PlaybackConfig(roi=(0, 0, 6, 6), params=LGMDParams(n_ts=3, t_sf=7.0)))
    assert max(frame.response.spike_frequency for frame in run) == 0  # the square is outside the region
    assert run.neuron.params == LGMDParams(n_ts=3, t_sf=7.0)


def test_the_neuron_skips_duplicates_and_holds_its_response(tmp_path):
    """Every fifth frame is stored twice, with noise on the copy."""
    rng = np.random.default_rng(0)
    texture = rng.integers(0, 255, (40, 60), np.uint8)
    moving = [np.roll(texture, 2 * n, 1) for n in range(40)]
    stored, copies = [], []
    for number, frame in enumerate(moving):
        stored.append(frame)
        if number % 5 == 4:
            copies.append(len(stored))
            stored.append(noisy(frame, rng, 1))
    path = write_lossless(tmp_path / "clip.mkv", stored)
    run = ClipRun(path, PlaybackConfig(drop_duplicates=0.25))
    frames = list(run)
    assert [frame.frame for frame in frames if frame.duplicate] == copies
    assert run.duplicates == len(copies)
    neuron = LGMD((40, 60), 30.0)
    assert [frame.response for frame in frames if not frame.duplicate] == [neuron.step(f) for f in moving]
    assert all(frames[n].response == frames[n - 1].response for n in copies)
    assert not any(frame.duplicate for frame in ClipRun(path, PlaybackConfig()))


def test_a_static_scene_is_dropped_only_at_first():
    duplicates, rng = DuplicateFilter(0.25), np.random.default_rng(0)
    moving = [rng.integers(0, 255, (8, 8), np.uint8) for _ in range(20)]
    static = [noisy(moving[-1], rng, 2) for _ in range(60)]
    assert not any(duplicates.is_duplicate(frame) for frame in moving)
    dropped = [duplicates.is_duplicate(frame) for frame in static]
    assert dropped[0]
    assert not any(dropped[-20:])


def clip_frame(number, frequency, onset=False, alert=False):
    response = Response(frequency, 1, 0.6, 0.6, 2.0, 0.5, 10.0, alert)
    return ClipFrame(number, number / 30.0, np.zeros((4, 4, 3), np.uint8), False, response, onset)


def test_a_summary_has_a_bounded_size_and_keeps_the_peaks():
    summary = ClipSummary(30.0, crash_frame=9_000)
    frequencies = np.random.default_rng(0).random(10_000)
    for number, frequency in enumerate(frequencies):
        summary.add(clip_frame(number, float(frequency), onset=number % 100 == 50, alert=number >= 600))
    series = summary.series()
    assert BINS / 4 < len(series["time"]) <= BINS
    assert series["spike_frequency"].max() == summary.peak == frequencies.max()
    assert (summary.frames, summary.onsets, summary.alarms, summary.first_alarm) == (10_000, 100, 9_400, 20.0)
    assert (np.diff(series["time"]) > 0).all()
    pictures = [(label, round(time * 30)) for label, time, _ in summary.pictures()]
    onset = "alarm begins"
    assert pictures == [(onset, 50), (onset, 8950), ("crash", 9000), (onset, 9850), (onset, 9950)]


def test_a_summary_without_onset_shows_the_peak():
    summary = ClipSummary(30.0)
    for number in range(10):
        summary.add(clip_frame(number, 5.0 if number == 4 else 1.0))
    assert [(label, time) for label, time, _ in summary.pictures()] == [("highest frequency", 4 / 30)]


# Detection


def alarms(length, *spans):
    alarm = np.zeros(length, bool)
    for first, last in spans:
        alarm[first:last] = True
    return alarm


def test_an_onset_follows_a_third_of_a_second_without_alarm():
    alarm = alarms(100, (5, 8), (20, 30), (35, 40), (60, 61))
    assert find_onsets(alarm, 30.0).tolist() == [20, 60]
    assert find_onsets(alarm, 15.0).tolist() == [5, 20, 35, 60]


def test_only_an_onset_in_the_window_before_the_crash_is_a_hit():
    alarm = alarms(300, (50, 60), (130, 150), (215, 280))
    item = detect("c", 100.0 * alarm, alarm, 30.0, 230 / 30)
    assert item.lead_s == pytest.approx(15 / 30)
    assert (item.alarm_frames.k, item.alarm_frames.n) == (30, 230 - 45 - 8)
    assert item.chance.onsets == 2
    assert item.chance.probability == pytest.approx(1 - np.exp(-2 * 45 / 177))
    # Garwood's interval of 2 events: 0.2422 to 7.2247
    assert item.chance.low == pytest.approx(1 - np.exp(-0.2422 * 45 / 177), abs=1e-4)
    assert item.chance.high == pytest.approx(1 - np.exp(-7.2247 * 45 / 177), abs=1e-4)
    late = detect("c", 100.0 * alarm, alarm, 30.0, 215 / 30)
    assert late.lead_s is None  # the alarm begins at the crash
    continuous = detect("c", 100.0 * alarm, alarms(300, (100, 300)), 30.0, 250 / 30)
    assert continuous.lead_s is None  # the alarm begins before the window


def test_a_clip_without_crash_or_without_an_earlier_part():
    no_crash = detect("n", np.zeros(90), np.zeros(90, bool), 30.0, None)
    assert (no_crash.lead_s, no_crash.alarm_frames.n, no_crash.chance.onsets) == (None, 82, 0)
    short = detect("s", np.zeros(90), np.zeros(90, bool), 30.0, 1.0)
    assert (short.chance.low, short.chance.high) == (0.0, 1.0)
    assert np.isnan(short.chance.probability)


def test_the_p_value_uses_the_upper_bound_of_the_chance_level():
    alarm = alarms(300, (280, 290))
    total = summarize_detections([detect(f"c{n}", 100.0 * alarm, alarm, 30.0, 285 / 30) for n in range(2)])
    assert (total.hits.k, total.hits.n, total.lead_s) == (2, 2, pytest.approx(5 / 30))
    assert total.p_value == pytest.approx(total.chance.high**2)


# The published clips, which are not part of the project


@pytest.fixture(scope="module")
def jobs():
    """All published clips."""
    if not VIDEOS.is_dir():
        pytest.skip("no clips: set LGMD_VIDEOS to the folder of the published clips")
    files = find_published(VIDEOS)
    if files.missing:
        pytest.skip(f"no clips {', '.join(clip.name for clip in files.missing)} in {VIDEOS}")
    return files.jobs


@pytest.mark.parametrize(
    ("config", "hits", "onsets", "alarm_frames"), [("paper", 5, 5, 102), ("conservative", 7, 1, 41)]
)
def test_detection_on_the_clips_used_for_choices(jobs, config, hits, onsets, alarm_frames):
    """The numbers of docs/clips.md; `conservative` was selected on these clips."""
    found = {}
    for job in jobs[:9]:
        responses = [f.response for f in ClipRun(job.clip, PLAYBACK_CONFIGS[config])]
        frequencies, alarm = zip(*((r.spike_frequency, r.alert) for r in responses), strict=True)
        found[job.name] = detect(job.name, frequencies, alarm, 30.0, job.crash_s)
    total = summarize_detections(found.values())
    assert (total.hits.k, total.hits.n, total.chance.onsets) == (hits, 7, onsets)
    assert (total.alarm_frames.k, total.alarm_frames.n) == (alarm_frames, 845)
    assert found["nc03"].alarm_frames.k == 0
    assert found["nc03"].peak < 30


def test_the_traces_of_the_documentation(jobs):
    """At the setting of the paper, for every frame of the 16 clips."""
    traces = read_traces(Path(__file__).parents[2] / "docs" / "clip_traces.csv")
    stored = {trace.clip: trace for trace in traces if trace.configuration == HEADLINE}
    assert list(stored) == [job.name for job in jobs]
    for job in jobs:
        responses = [f.response for f in ClipRun(job.clip, PLAYBACK_CONFIGS[HEADLINE])]
        frequency, potential = zip(
            *((r.spike_frequency, r.membrane_potential) for r in responses), strict=True
        )
        np.testing.assert_allclose(stored[job.name].spike_frequency, frequency, rtol=1e-5)
        np.testing.assert_allclose(stored[job.name].membrane_potential, potential, atol=6e-4)
