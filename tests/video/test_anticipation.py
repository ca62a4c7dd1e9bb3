"""Tests of the scores of accident anticipation, by values worked out by hand."""

import math

import numpy as np
import pytest

from lgmd_gym.clips.scores import ScoredClip, anticipation
from lgmd_gym.clips.tables import score_table


def scored(frames, event, fps=10.0, **peaks):
    """A clip of zeros with peaks: f20=50 is a score of 50 at frame 20."""
    scores = np.zeros(frames)
    for name, value in peaks.items():
        scores[int(name[1:])] = value
    return ScoredClip(f"clip{frames}", scores, event, fps)


# At 10 Hz the window has 15 frames. A has scores of 50 and 80, 2.0 s and 0.4 s before the event; B is shorter
# than 1.5 s and always 20. Of the clips without an event, one has 6 windows, the first with 30; the other is
# shorter than the window and has 10.
A = scored(40, True, f20=50, f36=80)
B = ScoredClip("B", np.full(10, 20.0), True, 10.0)
CLIPS = [A, B, scored(20, False, f0=30), scored(10, False, f4=10)]


def values(result):
    return {score.name: score.value for score in result.scores}


def test_the_figures_by_hand():
    result = anticipation(CLIPS, cap=0.1)
    # False alarms: (1/6 + 1)/2 at 10, (1/6 + 0)/2 = 1/12 at 20 and 30, 0 at 50 and 80.
    assert (result.threshold, result.events, result.negatives) == (20.0, 2, 2)
    # AP at 0.5 s: B is in alarm at 20 with 1/6 of a clip in false alarm; A, with 0, follows at 2 of 4 clips.
    first, second = 0.5 * (1 / (1 + 1 / 6)) + 0.5 * 2 / 4, 0.5 + 0.5 * 2 / (2 + 1 / 6)
    assert values(result) == pytest.approx({
        "false alarms": 1 / 12,
        "recall at 0.5 s": 0.5,  # the window of A has the frames 21 to 35
        "recall at 1.0 s": 1.0,
        "recall at 1.5 s": 1.0,  # of A alone
        "AP at 0.5 s": first,
        "AP at 1.0 s": second,
        "AP at 1.5 s": 1.0,
        "mean AP": (first + second + 1.0) / 3,
        "TTA at the cap": (2.0 + 1.0) / 2,
        "TTA at recall 80 %": (2.0 + 1.0) / 2,
        "mTTA": 0.5 * 0.4 + 0.5 * 1.5,  # half of the recall at 80, the other half at 20
    })  # fmt: skip
    assert {score.name: score.n for score in result.scores} == {
        "false alarms": 2, "recall at 0.5 s": 2, "recall at 1.0 s": 2, "recall at 1.5 s": 1, "AP at 0.5 s": 4,
        "AP at 1.0 s": 4, "AP at 1.5 s": 3, "mean AP": 4, "TTA at the cap": 2, "TTA at recall 80 %": 2,
        "mTTA": 2,
    }  # fmt: skip


@pytest.mark.parametrize(("cap", "threshold"), [(0.0, 50.0), (0.08, 50.0), (1 / 12, 20.0), (0.6, 10.0)])
def test_the_cap_chooses_the_lowest_threshold(cap, threshold):
    assert anticipation(CLIPS, cap).threshold == threshold


def test_equal_scores_alarm_together():
    """At 20, a clip without an event is in alarm as well; no higher score exists."""
    clips = [B, ScoredClip("negative", np.full(15, 20.0), False, 10.0)]
    result = anticipation(clips, cap=0.1)
    assert math.isinf(result.threshold)
    found = values(result)
    assert (found["false alarms"], found["recall at 0.5 s"], found["TTA at the cap"]) == (0.0, 0.0, None)
    assert found["AP at 0.5 s"] == pytest.approx(0.5)
    capless = anticipation(clips, cap=1.0)
    assert (capless.threshold, values(capless)["recall at 0.5 s"]) == (20.0, 1.0)


def test_a_score_of_zero_is_never_an_alarm():
    result = anticipation([scored(30, True), scored(30, False)], cap=1.0)
    found = values(result)
    assert (found["recall at 0.5 s"], found["mTTA"], found["AP at 1.0 s"]) == (0.0, None, 0.5)


def test_evaluated_frames():
    """The first 8/30 s are left out, and all frames from the event on."""
    ramp = np.arange(100.0)
    assert ScoredClip.of("c", ramp, 30.0, 2.0).scores.tolist() == ramp[8:60].tolist()
    assert ScoredClip.of("c", ramp, 30.0, 2.0, 1.0, 2.5).scores.tolist() == ramp[30:60].tolist()
    assert ScoredClip.of("c", ramp, 30.0, None, 0.0, 3.0).scores.tolist() == ramp[8:90].tolist()
    assert ScoredClip.of("c", ramp, 30.0, None).scores.tolist() == ramp[8:].tolist()


def test_the_order_of_clips_does_not_change_the_figures():
    assert values(anticipation(CLIPS[::-1])) == pytest.approx(values(anticipation(CLIPS)))


def by_ranking(positive, negative):
    """Average precision of single scores, with equal scores in one step."""
    total, recall = 0.0, 0.0
    for level in sorted({*positive, *negative}, reverse=True):
        hits, false = sum(v >= level for v in positive), sum(v >= level for v in negative)
        step = hits / len(positive) - recall
        total, recall = total + step * hits / (hits + false), hits / len(positive)
    return total


def test_average_precision_equals_that_of_ranked_clips():
    rng = np.random.default_rng(3)
    positive, negative = rng.integers(0, 6, 30) + 1, rng.integers(0, 6, 20)
    clips = [ScoredClip("p", np.full(40, float(v)), True, 10.0) for v in positive]
    clips += [ScoredClip("n", np.full(40, float(v)), False, 10.0) for v in negative]
    found = values(anticipation(clips))
    assert found["AP at 1.0 s"] == pytest.approx(by_ranking(positive.tolist(), negative.tolist()))


def test_intervals_and_chance():
    """Two events 1 s and 3 s after their alarms: a quarter of the samples has only one of them."""
    clips = [scored(40, True, f30=9), scored(40, True, f10=9), scored(60, False), scored(60, False)]
    found = {score.name: score for score in anticipation(clips).scores}
    assert (found["mTTA"].value, found["mTTA"].low, found["mTTA"].high) == pytest.approx((2.0, 1.0, 3.0))
    recall = found["recall at 1.0 s"]
    assert (recall.value, recall.chance, recall.p_value) == (0.5, 0.0, 0.0)
    assert (recall.low, recall.high) == (0.0, 1.0)
    always = [clip._replace(scores=clip.scores + 1) for clip in clips]
    everything = {score.name: score for score in anticipation(always, cap=1.0).scores}
    assert (everything["recall at 0.5 s"].chance, everything["recall at 0.5 s"].p_value) == (1.0, 1.0)
    assert everything["recall at 0.5 s"].low == pytest.approx(0.342, abs=1e-3)  # Wilson's of 2 of 2
    assert everything["TTA at the cap"].chance == pytest.approx(4.0)  # the length of the clips


@pytest.mark.slow
def test_a_random_score_has_the_chance_level():
    rng = np.random.default_rng(0)
    # Clips with an event are shorter, so that their random replacements come from many positions. A thousand
    # levels suffice: a level differs by 1 % of the false alarms from the next one.
    kinds = [number % 3 == 0 for number in range(120)]
    scores = [rng.integers(1, 1001, 40 if event else 80) / 1000 for event in kinds]
    clips = [ScoredClip("c", each, event, 10.0) for each, event in zip(scores, kinds, strict=True)]
    found = {score.name: score for score in anticipation(clips, cap=0.2).scores}
    assert found["recall at 1.0 s"].chance == pytest.approx(0.2, abs=0.05)
    assert found["AP at 1.0 s"].chance == pytest.approx(1 / 3, abs=0.05)


def test_without_clips_of_one_kind():
    found = {score.name: score for score in anticipation([A, B]).scores}
    assert found["mTTA"].value == pytest.approx(0.95)
    assert {name for name, score in found.items() if score.value is None} == set(found) - {
        "mTTA", "TTA at recall 80 %"
    }  # fmt: skip
    assert "need clips without an event" in str(score_table("paper", anticipation([A, B])).title)
    with pytest.raises(ValueError, match="no clip has an evaluated frame before an event"):
        anticipation(CLIPS[2:])
    with pytest.raises(ValueError, match=r"cap must be in \[0, 1\], got 10"):
        anticipation(CLIPS, cap=10)
