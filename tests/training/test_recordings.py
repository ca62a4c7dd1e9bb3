"""Files of recorded episodes, and the episodes that a training run records or reuses."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.recordings import recorded_config, synthetic_episode

from lgmd_gym.envs.registration import TRAFFIC_KINDS, traffic_id
from lgmd_gym.training import recordings, train
from lgmd_gym.training.config import RANDOM_ID
from lgmd_gym.training.offline.driving import DriveRecorder
from lgmd_gym.training.offline.episodes import _difference, check_file, load, save
from lgmd_gym.training.recordings import check_recordings, load_or_record, origin_of, recording_sets


def write_episodes(folder, config, by_seed, settings=None):
    folder.mkdir(parents=True, exist_ok=True)
    save(by_seed, folder / f"{len(list(folder.iterdir()))}.npz", origin_of(config) | (settings or {}))


def test_files_restore_every_episode(tmp_path):
    threat = synthetic_episode(4, frames=True)
    segment = synthetic_episode(2, seed=1, threat=False, traffic=True, frames=True)
    save([[threat, segment], []], tmp_path / "some.npz", {"camera": "fovea"})
    with np.load(tmp_path / "some.npz") as arrays:  # earlier files have one entry more
        np.savez(tmp_path / "some.npz", traffic=np.array([False, True]), **arrays)
    assert check_file(tmp_path / "some.npz", {"camera": "fovea"}) == 2
    restored, empty = load(tmp_path / "some.npz")
    assert empty == []
    for left, right in zip((threat, segment), restored, strict=True):
        assert (left.threat, left.family) == (right.threat, right.family) != (True, "")
        for name in ("time_to_brake", "demands"):
            assert np.array_equal(getattr(left, name), getattr(right, name))
        for name in left.observations:
            assert np.array_equal(left.observations[name], right.observations[name])


@pytest.mark.parametrize("text", ["text", ""])
def test_file_without_episodes_is_rejected(tmp_path, text):
    (tmp_path / "text.npz").write_text(text)
    with pytest.raises(ValueError, match=r"text\.npz' contains no recorded episodes"):
        load(tmp_path / "text.npz")


def test_a_damaged_file_is_rejected_before_training(tmp_path):
    config = recorded_config(tmp_path, recordings=str(tmp_path), eval_episodes=1, n_timesteps=1)
    for name in ("train", "validation"):
        write_episodes(tmp_path / "episodes" / name, config, [[synthetic_episode()]])
    file = tmp_path / "episodes" / "train" / "0.npz"
    content = bytearray(file.read_bytes())
    content[100] ^= 255
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"0\.npz' is damaged; lgmd-gym train --resume .* records it again"):
        check_recordings(config)


def test_the_message_for_other_settings_shows_the_first_difference():
    lenses = [{"name": "fovea", "reach": 1.0, "span_m": 2.4}, {"name": "wide", "reach": 1.0}]
    others = [lenses[0], {"name": "wide", "reach": 2.0}]
    assert _difference(lenses, others) == ({"reach": 1.0}, {"reach": 2.0})
    assert _difference(lenses, lenses[:1]) == (lenses, lenses[:1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"camera": "wide"}, 'another camera \\("fovea", not "wide"\\); omit --recordings'),
        (
            {"camera": {"name": "fovea", "shape": (9, 16)}},
            r'another camera \("fovea", not {"name": "fovea", "shape": \[9, 16\]}\)',
        ),
        ({"n_timesteps": 9}, "holds 2 episodes, 9 are required; reduce the number"),
        ({"env_kwargs": {"world": 3}, "n_timesteps": 2}, "recorded with another env_kwargs"),
    ],
)
def test_unsuitable_recordings_are_rejected(tmp_path, options, message):
    for _ in range(2):
        write_episodes(tmp_path / "episodes" / "train", recorded_config(tmp_path), [[synthetic_episode()]])
    config = recorded_config(tmp_path, recordings=str(tmp_path), **options)
    with pytest.raises(ValueError, match=message):
        check_recordings(config)


def test_missing_recordings_are_rejected_before_the_folder_is_made(tmp_path):
    config = recorded_config(tmp_path, recordings=str(tmp_path / "missing"))
    with pytest.raises(ValueError, match=r"no recorded episodes in .*missing.*; train once with"):
        train(config, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_interrupted_recording_resumes_at_the_missing_file(tmp_path, monkeypatch):
    recorded = []

    def record(self, seeds):
        if len(recorded) == 2:
            raise KeyboardInterrupt
        recorded.append(seeds)
        return [[synthetic_episode(seed=seed)] for seed in seeds]

    monkeypatch.setattr(recordings, "FILE_SIZE", 2)
    monkeypatch.setattr(DriveRecorder, "record", record)
    config = recorded_config(tmp_path, n_timesteps=5)
    with pytest.raises(KeyboardInterrupt):
        load_or_record(config, "train", tmp_path)
    del recorded[:1]
    episodes = load_or_record(config, "train", tmp_path)
    assert recorded == [range(2, 4), range(4, 5)]
    expected = [synthetic_episode(seed=seed).observations["ego_speed"][0] for seed in range(5)]
    assert [episode.observations["ego_speed"][0] for episode in episodes] == expected
    del recorded[:]
    load_or_record(replace(config, n_timesteps=6), "train", tmp_path)
    assert recorded == [range(4, 6)]  # of the last file, which had one seed
    with pytest.raises(ValueError, match=r"recorded with another env_kwargs .*; train in a new folder$"):
        load_or_record(replace(config, env_kwargs={"world": 3}), "train", tmp_path)


@pytest.mark.parametrize(
    ("env_id", "camera"), [(traffic_id(next(iter(TRAFFIC_KINDS))), "fovea"), (RANDOM_ID, "birdseye")]
)
def test_environments_that_the_engine_does_not_have_are_rejected(tmp_path, env_id, camera):
    config = recorded_config(tmp_path, env_id, camera=camera)
    with pytest.raises(ValueError, match=f"requires a braking environment and no top view, got '{env_id}'"):
        train(config, tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_traffic_recordings_are_required_in_addition(tmp_path):
    config = recorded_config(
        tmp_path, recordings=str(tmp_path), traffic_episodes=9, eval_episodes=1, n_timesteps=1
    )
    sets = [*recording_sets(config, "train"), *recording_sets(config, "validation")]
    assert [item.name for item in sets] == ["train", "traffic-train", "validation", "traffic-validation"]
    assert [len(item.seeds) for item in sets] == [1, 9, 1, 3]
    _, traffic_train, _, traffic_validation = (set(item.seeds) for item in sets)
    assert not traffic_train & traffic_validation
    assert min(traffic_train | traffic_validation) >= 10_000  # the traffic suite uses the seeds from 0 on
    for name in ("train", "validation"):
        write_episodes(tmp_path / "episodes" / name, config, [[synthetic_episode()]])
    with pytest.raises(ValueError, match="--algo time-to-brake --traffic-episodes 9, without --recordings"):
        check_recordings(config)
    for name in ("traffic-train", "traffic-validation"):
        by_seed = [[], [synthetic_episode(), synthetic_episode()], []]
        write_episodes(tmp_path / "episodes" / name, config, by_seed, {"horizon_s": 3.0})
    with pytest.raises(ValueError, match="traffic-train' holds 3 episodes, 9 are required"):
        check_recordings(config)
    check_recordings(replace(config, traffic_episodes=3))


def test_extra_traffic_has_seeds_and_kinds_of_its_own(tmp_path):
    texts = ["9:merge,two-way", "4:merge"]
    config = recorded_config(tmp_path, traffic_episodes=5, extra_traffic=texts)
    sets = [item for split in ("train", "validation") for item in recording_sets(config, split)]
    traffic = {item.name: item for item in sets if "traffic" in item.name}
    assert {name: len(item.seeds) for name, item in traffic.items()} == {
        "traffic-train": 5,
        "extra-traffic1-train": 9,
        "extra-traffic2-train": 4,
        "traffic-validation": 2,
        "extra-traffic1-validation": 3,
        "extra-traffic2-validation": 1,
    }
    seeds = [seed for item in traffic.values() for seed in item.seeds]
    assert len(set(seeds)) == len(seeds)
    assert min(seeds) >= 10_000  # the traffic suite uses the seeds from 0 on
    extra = traffic["extra-traffic1-train"]
    assert extra.record.__self__.kinds == ("merge", "two-way")
    assert extra.settings == {"horizon_s": 3.0, "kinds": ["merge", "two-way"]}
    assert traffic["traffic-train"].record.__self__.kinds == tuple(TRAFFIC_KINDS)
    assert extra.option == " --extra-traffic 9:merge,two-way 4:merge"


def test_extra_levels_are_of_the_chosen_families(tmp_path):
    texts = ["41:CurvePass", "20:CCRs,EmptyRoad"]
    config = recorded_config(tmp_path, extra_levels=texts, eval_episodes=2, n_timesteps=3)
    sets = [*recording_sets(config, "train"), *recording_sets(config, "validation")]
    names = ["train", "extra1-train", "extra2-train", "validation", "extra1-validation", "extra2-validation"]
    assert [item.name for item in sets] == names
    assert [len(item.seeds) for item in sets] == [3, 41, 20, 2, 3, 1]
    ((episode,),) = sets[1].record(range(1))
    assert (episode.family, episode.threat) == ("CurvePass", False)
    assert {episode.family for (episode,) in sets[2].record(range(6))} == {"CCRs", "EmptyRoad"}


def test_every_error_level_has_errors_of_the_sensor(tmp_path):
    options = {"extra_levels": ["5:CCRs"], "error_levels": ["41:CCRs", "20:EmptyRoad"]}
    config = recorded_config(
        tmp_path, **options, eval_episodes=2, n_timesteps=3, env_kwargs={"sensor_errors": 0.1}
    )
    shares = {}
    for split in ("train", "validation"):
        sets = {item.name: item for item in recording_sets(config, split)}
        assert list(sets) == [split, *(f"{name}-{split}" for name in ("extra1", "errors1", "errors2"))]
        others = (split, f"errors1-{split}", f"errors2-{split}")
        seeds = [seed for name in others for seed in sets[name].seeds]
        assert len(set(seeds)) == len(seeds)  # other levels, also in two sets of one family
        shares |= {name: item.record.__self__.arguments["sensor_errors"] for name, item in sets.items()}
    assert {name for name, share in shares.items() if share == 1.0} == {
        f"errors{number}-{split}" for number in (1, 2) for split in ("train", "validation")
    }
    assert {share for share in shares.values() if share != 1.0} == {0.1}
    item = next(item for item in recording_sets(config, "train") if item.name == "errors1-train")
    assert item.settings == {"families": ["CCRs"], "sensor_errors": 1.0}
    assert item.option == " --error-levels 41:CCRs 20:EmptyRoad"
    assert len(item.seeds) == 41
    envs = gym.make_vec(item.record.__self__.env_id, num_envs=3, **item.record.__self__.arguments)
    envs.reset(seed=list(item.seeds[:3]))
    assert all(scene.pitch_error_deg != 0.0 for scene in envs.unwrapped.get_attr("scene"))
    envs.close()


def test_reused_extra_levels_are_of_the_same_families(tmp_path):
    text = "1:CurvePass"
    config = recorded_config(tmp_path, extra_levels=[text], eval_episodes=1, n_timesteps=1)
    reused = replace(config, recordings=str(tmp_path))
    for name in ("train", "validation"):
        write_episodes(tmp_path / "episodes" / name, config, [[synthetic_episode()]])
    with pytest.raises(ValueError, match=f"--algo time-to-brake --extra-levels {text}, without"):
        check_recordings(reused)
    for name in ("extra1-train", "extra1-validation"):
        folder = tmp_path / "episodes" / name
        folder.mkdir()
        save([[synthetic_episode()]], folder / "0.npz", origin_of(config) | {"families": ["CCRsCurve"]})
    with pytest.raises(ValueError, match="recorded with another families"):
        check_recordings(reused)


def test_a_damaged_file_is_recorded_again(tmp_path, monkeypatch):
    def record(self, seeds):
        return [[synthetic_episode(seed=seed)] for seed in seeds]

    monkeypatch.setattr(DriveRecorder, "record", record)
    config = recorded_config(tmp_path, n_timesteps=2)
    load_or_record(config, "train", tmp_path)
    (file,) = (tmp_path / "episodes" / "train").iterdir()
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    assert len([*load_or_record(config, "train", tmp_path)]) == 2
    assert len(file.read_bytes()) == len(whole)
