"""The page on driving clips states the results of the committed traces."""

import re
from pathlib import Path

import numpy as np
import pytest

from lgmd_gym.clips.detection import summarize_detections
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
from lgmd_gym.clips.published import published_clips
from lgmd_gym.clips.study import (
    HEADLINE,
    detections_of,
    groups_of,
    published_crashes,
    read_traces,
    results_text,
)

DOCS = Path(__file__).parents[2] / "docs"
PAGE = " ".join((DOCS / "clips.md").read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def traces():
    return read_traces(DOCS / "clip_traces.csv")


@pytest.fixture(scope="module")
def totals(traces):
    """Summary of each configuration over the new clips, and over all of them."""
    crashes = published_crashes([trace.clip for trace in traces])
    _, new, every = groups_of(crashes).values()
    return [
        {name: summarize_detections(items) for name, items in detections_of(traces, group).items()}
        for group in (new, every)
    ]


def test_the_traces_are_of_every_configuration_and_clip(traces):
    names = [clip.name for clip in published_clips()]
    assert [(trace.configuration, trace.clip) for trace in traces] == [
        (config, name) for config in PLAYBACK_CONFIGS for name in names
    ]
    for trace in traces:
        assert trace.fps == (PLAYBACK_CONFIGS[trace.configuration].fps or 30.0)
        assert len(trace.membrane_potential) == (
            len(trace.spike_frequency) if trace.configuration == HEADLINE else 0
        )
        assert trace.spike_frequency.min() >= 0.0
        assert np.isfinite(trace.spike_frequency).all()


def test_the_headline(totals):
    new, every = totals
    headline, upper = every["paper-18hz"], every["paper-18hz-30"]
    assert f"begins in the 1.5 s before {headline.hits.k} of {headline.hits.n} crashes" in PAGE
    assert f"{new['paper-18hz'].hits.k} of {new['paper-18hz'].hits.n} of them new" in PAGE
    assert f"with a probability of {headline.chance.probability:.2f}" in PAGE
    assert f"upper end of the paper's range, it is {upper.hits.k} of {upper.hits.n}" in PAGE


def test_the_presets_on_the_new_clips(totals):
    new, _ = totals
    assert min(total.p_value for total in new.values()) * len(new) > 0.05
    shares = {name: total.alarm_frames.k / total.alarm_frames.n for name, total in new.items()}
    assert min(shares, key=shares.get) == "off-only"
    off, literal = new["off-only"].hits, new["literal"].hits
    assert (
        f"{100 * shares['off-only']:.0f} % of the frames, and an onset before {off.k} of {off.n} crashes"
        in PAGE
    )
    assert (
        f"`literal`, have {100 * shares['literal']:.0f} % and an onset before {literal.k} of {literal.n}"
        in PAGE
    )


def test_the_tables(traces):
    text = results_text(traces, published_crashes([trace.clip for trace in traces]))
    headings = re.findall(r"^### (.*)$", text, re.MULTILINE)
    assert headings == [
        "9 clips used for earlier choices: 7 with a crash, 2 without",
        "7 new clips: 6 with a crash, 1 without",
        "All 16 clips: 13 with a crash, 3 without",
        "Single clips: T_sf = 15 spikes/s at 18 Hz",
        "Single clips: T_sf = 30 spikes/s at 18 Hz",
    ]
    short = sum(
        item.crash_s is not None and item.chance.seconds < 1.35
        for item in detections_of(traces, published_crashes([t.clip for t in traces]))["paper"]
    )
    assert f"({['five', 'six', 'seven'][short - 5]} of these 13 clips have 1.3 s or less)" in PAGE
