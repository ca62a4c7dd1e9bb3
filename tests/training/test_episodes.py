"""Recorded drives: that they tell what driving does, and that files keep them."""

from dataclasses import replace

import numpy as np
import pytest
from support.recordings import made_up, order

from lgmd_gym.training.offline.episodes import record
from lgmd_gym.training.offline.onsets import STRAIGHT, Outcome, outcomes
from lgmd_gym.training.offline.splits import check_drives, drives_of
from lgmd_gym.training.offline.storage import load, origin_of, save
from lgmd_gym.training.trainer import Training


@pytest.mark.parametrize("demands", [(0.0, -1.0), (-0.6, 0.0)])
def test_a_record_tells_what_closed_loops_return(tmp_path, demands):
    plan = order(tmp_path, demands=demands).plan()
    drives = record(plan, "train", range(3, 6), 1, lambda count: None)
    assert {drive.threat for drive in drives} == {False, True}
    view = replace(plan, features={**plan.features, "repeat": 1, "reward_scale": 1.0}).make_env("train")
    hold, brake = demands.index(0.0), demands.index(min(demands))
    for seed, drive in zip(range(3, 6), drives, strict=True):
        for onset in (0, 17, 24, len(drive) - 2):
            view.reset(seed=seed)
            held = [view.step(hold)[1] for _ in range(onset)]
            assert held == pytest.approx(drive.rewards[:onset].tolist(), abs=1e-4)
            _, ret, _, _, info = view.step(brake)
            assert ret == pytest.approx(drive.returns[onset], abs=3 * STRAIGHT)
            assert info["collision"] == drive.contacts[onset]


@pytest.mark.slow
def test_processes_record_the_same(tmp_path):
    plan, counted = order(tmp_path).plan(), []
    one = record(plan, "validation", range(4), 1, lambda count: None)
    two = record(plan, "validation", range(4), 2, counted.append)
    assert sum(counted) == 4
    for left, right in zip(one, two, strict=True):
        assert left.returns.tobytes() == right.returns.tobytes()
        assert all(left.seen[name].tobytes() == right.seen[name].tobytes() for name in left.seen)


def test_few_replays_find_jumps_and_bends():
    asked = []

    def truth(onset):
        contact = onset >= 37
        return Outcome(-12.0 - onset * 0.1 if contact else -3.0 + 0.05 * onset, contact)

    def replay(onset):
        asked.append(onset)
        return truth(onset)

    found = outcomes(60, replay)
    # 6 on the grid, 5 middles, and around the jump, between 36 and 48, middles of halves: 39, 45, 37, 40, 38
    assert len(asked) == len(set(asked)) == 16
    for onset, item in enumerate(found):
        assert item.contact == truth(onset).contact
        assert item.ret == pytest.approx(truth(onset).ret, abs=STRAIGHT)
    assert outcomes(1, truth) == [truth(0)]


def test_a_file_gives_back_its_drives(tmp_path):
    drives = [made_up(4, frame=True), made_up(2, seed=1, threat=False, frame=True)]
    save([drives, []], tmp_path / "some.npz", {"camera": "fovea"})
    again, origin = load(tmp_path / "some.npz")
    assert origin == {"camera": "fovea"}
    assert again[1:] == [[]]
    for left, right in zip(drives, again[0], strict=True):
        assert left.threat == right.threat
        for name in ("rewards", "returns", "contacts"):
            assert np.array_equal(getattr(left, name), getattr(right, name))
        assert all(np.array_equal(left.seen[name], right.seen[name]) for name in left.seen)
        assert np.array_equal(left.frames, right.frames)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"camera": ("wide",)}, 'recorded with another camera \\("fovea", not "wide"\\); record anew'),
        ({"steps": 9}, "holds 2 drives, 9 are wanted; ask for fewer"),
        ({"inputs": ("frame",), "steps": 2}, "recorded with another shrink"),
    ],
)
def test_drives_of_another_kind_are_refused(tmp_path, changes, words):
    kept = tmp_path / "drives" / "train"
    kept.mkdir(parents=True)
    for number in range(2):
        save([[made_up()]], kept / f"{number}.npz", origin_of(order(tmp_path).plan()))
    plan = order(tmp_path, drives=tmp_path, **changes).plan()
    with pytest.raises(ValueError, match=words):
        check_drives(plan)


def test_an_interrupted_recording_goes_on(tmp_path, monkeypatch):
    from lgmd_gym.training.offline import splits as lots

    asked, plan = [], order(tmp_path, steps=5).plan()

    def recorded(plan, split, seeds, jobs, tell):
        if len(asked) == 2:
            raise KeyboardInterrupt
        asked.append(seeds)
        return [made_up(seed=seed) for seed in seeds]

    monkeypatch.setattr(lots, "PART", 2)
    monkeypatch.setattr(lots, "record", recorded)
    with pytest.raises(KeyboardInterrupt):
        drives_of(plan, "train", tmp_path, progress=False, jobs=1)
    del asked[:1]
    drives = drives_of(plan, "train", tmp_path, progress=False, jobs=1)
    assert asked == [range(2, 4), range(4, 5)]
    assert [drive.rewards[0] for drive in drives] == [made_up(seed=seed).rewards[0] for seed in range(5)]


def test_no_drives_are_named(tmp_path):
    wanted = order(tmp_path, drives=tmp_path / "nowhere")
    with pytest.raises(ValueError, match=r"no recorded drives in .*nowhere.*; train once with"):
        Training.start(wanted, tmp_path / "run")
    assert not (tmp_path / "run").exists()  # so that the same command will do once the drives are there
    (tmp_path / "train.npz").write_text("nothing")
    with pytest.raises(ValueError, match="holds no recorded drives"):
        load(tmp_path / "train.npz")
