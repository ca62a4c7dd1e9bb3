"""Tests of the published set of stimuli: pinned hashes, ground truth, files and the command."""

import csv
import hashlib
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support.clips import ffmpeg

from lgmd_gym.cli import main as cli
from lgmd_gym.clips.video import VideoReader, VideoWriter, luma
from lgmd_gym.paper import stimulus_files
from lgmd_gym.paper.backgrounds import Screen
from lgmd_gym.paper.stimuli import SET_VERSION, Receding, Translating, stimulus_set
from lgmd_gym.paper.stimulus_files import check_stimuli, choose_stimuli, set_screen, write_stimuli

PINNED = json.loads((Path(__file__).parents[1] / "golden" / "stimuli.json").read_text())
SMALL = set_screen(30.0, (90, 45))


def run(*arguments):
    return cli.run(["stimuli", *map(str, arguments)])


def rows_of(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def raw_hash(path):
    return hashlib.sha256(b"".join(luma(picture).tobytes() for picture in VideoReader(path))).hexdigest()


def test_the_frames_of_version_1_are_pinned():
    """A change of a frame needs a new `SET_VERSION` and, with it, new hashes."""
    assert SET_VERSION == 1
    found = {name: stimulus.sha256(SMALL) for name, stimulus in stimulus_set().items()}
    assert list(found) == list(PINNED)
    assert [name for name, digest in found.items() if digest != PINNED[name]] == []


@pytest.mark.slow
def test_the_published_size_is_pinned():
    """The hash that docs/howto/stimuli.md states."""
    screen = set_screen()
    entries = {name: {"frames_sha256": item.sha256(screen)} for name, item in stimulus_set().items()}
    text = "".join(f"{entry['frames_sha256']}  {name}\n" for name, entry in sorted(entries.items()))
    digest = hashlib.sha256(text.encode()).hexdigest()
    assert digest == "93f59705d8416724bd7281106ca37b1a62a91c153a54ac1654c3de4b1f453ad2"
    assert digest in (Path(__file__).parents[2] / "docs" / "howto" / "stimuli.md").read_text(encoding="utf-8")


def test_a_half_level_is_rounded_up_whatever_its_last_bits():
    """127.5 occurs at each zero of a grating, with the rounding errors of the sine."""

    class Background:
        def render(self, time, screen):
            return np.array([[127.5 - 1e-12, 127.5, 127.5 + 1e-12, 127.49, 126.5]])

    from lgmd_gym.paper.stimuli import stimulus_frames

    frame = next(stimulus_frames(Screen(shape=(1, 5)), 1.0, Background()))
    assert frame.tolist() == [[128, 128, 128, 127, 127]]


@pytest.mark.parametrize(
    ("name", "frame", "label", "degrees", "contact", "l_over_v"),
    [
        ("looming-square-dark-100ms", 60, "approach", 2 * math.degrees(math.atan(0.1)), 1.0, 0.1),
        ("looming-disc-light-20ms", 0, "approach", 2 * math.degrees(math.atan(0.02 / 3)), 3.0, 0.02),
        # tan 40° = 0.839: the largest size is reached 0.119 s before contact, between frames 86 and 87
        ("looming-in-panorama-dark", 86, "approach", 2 * math.degrees(math.atan(0.1 * 30 / 4)), 4 / 30, 0.1),
        ("looming-in-panorama-dark", 87, "still", 80.0, 0.1, 0.1),
        ("receding-square-dark-200ms", 12, "still", 80.0, None, 0.2),  # at 0.4 s, the contact
        ("receding-square-dark-200ms", 27, "recede", 2 * math.degrees(math.atan(0.4)), -0.5, 0.2),
        ("translating-square-light-0.3mps", 45, "translate", 2 * math.degrees(math.atan(4 / 30)), None, None),
        # its left side leaves the screen, 0.27 m from the centre, (0.27 + 0.04) / 0.3 = 1.033 s later
        (
            "translating-square-light-0.3mps",
            75,
            "translate",
            math.degrees(math.atan(0.34 / 0.3) - math.atan(0.26 / 0.3)),
            None,
            None,
        ),
        (
            "translating-square-light-0.3mps",
            77,
            "outside",
            math.degrees(math.atan(0.36 / 0.3) - math.atan(0.28 / 0.3)),
            None,
            None,
        ),
        (
            "translating-square-light-0.3mps",
            13,
            "outside",
            math.degrees(math.atan(0.36 / 0.3) - math.atan(0.28 / 0.3)),
            None,
            None,
        ),
        ("elongating-bar-dark-0.108mps", 0, "elongate", 2 * math.degrees(math.atan(1 / 30)), None, None),
        ("grating-40-per-m-2hz", 89, "none", 0.0, None, None),
        ("panorama", 3, "none", 0.0, None, None),
    ],
)
def test_ground_truth_by_hand(name, frame, label, degrees, contact, l_over_v):
    truth = stimulus_set()[name].truth(set_screen())
    assert len(truth) == 90
    row = truth[frame]
    assert (row.time_s, row.label) == (frame / 30, label)
    assert row.angular_size_deg == pytest.approx(degrees)
    assert row.time_to_contact_s == (None if contact is None else pytest.approx(contact))
    assert row.l_over_v_s == l_over_v


def test_the_angle_of_a_passing_object_is_between_the_directions_of_its_sides():
    """From 0.2 to 0.28 m beside the centre of a screen at 0.3 m."""
    row = Translating(speed=0.1, centred=0.0).truth(2.4, Screen())
    assert row.angular_size_deg == pytest.approx(math.degrees(math.atan2(0.28, 0.3) - math.atan2(0.2, 0.3)))


def test_size_and_time_to_contact_agree_while_an_object_moves():
    screen = set_screen()
    for stimulus in stimulus_set().values():
        for row in stimulus.truth(screen):
            if row.label in ("approach", "recede"):
                angle = 2.0 * math.degrees(math.atan(row.l_over_v_s / abs(row.time_to_contact_s)))
                assert row.angular_size_deg == pytest.approx(angle)
                assert (row.time_to_contact_s > 0) == (row.label == "approach")


def test_a_receding_object_reverses_a_looming_one():
    screen, stimuli = set_screen(), stimulus_set()
    away = Receding(l_over_v=0.1, contact=0.0)
    looming = stimuli["looming-square-dark-100ms"].foreground
    assert away.box(1.0, screen) == looming.box(2.0, screen)


def test_the_set_has_the_stimuli_of_the_paper():
    names = list(stimulus_set())
    assert len(names) == 70
    for spatial in (40, 60, 80):
        for shade in ("dark", "light"):
            assert f"looming-in-grating-{spatial}-per-m-contrast-1-{shade}" in names
    kinds = {name.split("-")[0] for name in names}
    assert kinds == {"looming", "receding", "translating", "elongating", "grating", "panorama"}
    assert len({item.sha256(SMALL) for item in choose_stimuli(["looming-*dark*"])}) == 17


@pytest.mark.parametrize("suffix", ["mkv", "y4m"])
def test_files_are_lossless_and_deterministic(suffix, tmp_path):
    chosen = choose_stimuli(["looming-disc-light-50ms", "panorama"])
    screen = set_screen(18.0, (45, 31))
    folders = [tmp_path / "one", tmp_path / "two"]
    for folder in folders:
        folder.mkdir()
        write_stimuli(folder, chosen, screen, suffix=suffix)
    contents = [{path.name: path.read_bytes() for path in folder.iterdir()} for folder in folders]
    assert contents[0] == contents[1]
    manifest = check_stimuli(folders[0])
    assert (manifest["version"], manifest["screen"]["shape"]) == (1, [31, 45])
    for stimulus in chosen:
        entry = manifest["stimuli"][stimulus.name]
        assert raw_hash(folders[0] / entry["video"]) == entry["frames_sha256"] == stimulus.sha256(screen)
        assert entry["frames"] == 54
        for kind in ("video", "truth"):
            assert hashlib.sha256(contents[0][entry[kind]]).hexdigest() == entry[f"{kind}_sha256"]
    assert manifest["stimuli"]["panorama"]["background"] == {
        "type": "Panorama", "speed": 0.05, "contrast": 0.15, "seed": 0
    }  # fmt: skip


def test_the_command_writes_videos_and_ground_truth(tmp_path, capsys):
    out = tmp_path / "out"
    assert run("receding-*-dark-100ms", "grating-*-2hz", "--size", 90, 45, "--out", out) == 0
    printed = capsys.readouterr().out
    manifest = json.loads((out / "manifest.json").read_text())
    assert f"5 stimuli, SHA-256 {manifest['sha256']}" in printed
    assert {name: entry["frames_sha256"] for name, entry in manifest["stimuli"].items()} == {
        name: digest for name, digest in PINNED.items() if name in manifest["stimuli"]
    }
    rows = rows_of(out / "receding-disc-dark-100ms.csv")
    assert list(rows[0]) == [
        "frame", "time_s", "label", "angular_size_deg", "time_to_contact_s", "l_over_v_s"
    ]  # fmt: skip
    assert list(rows[0].values()) == ["0", "0.000000", "still", "80.000000", "", "0.100000"]
    # 0.1 s after the contact the half size would be 45°: the disc rests at 40°
    assert list(rows[15].values()) == ["15", "0.500000", "still", "80.000000", "-0.100000", "0.100000"]
    assert list(rows[42].values()) == ["42", "1.400000", "recede", "11.421186", "-1.000000", "0.100000"]
    assert run("--check", out) == 0
    assert f"5 stimuli equal their manifest, SHA-256 {manifest['sha256']}" in capsys.readouterr().out


@pytest.mark.parametrize("suffix", ["mkv", "y4m"])
def test_the_hash_is_that_of_ffmpeg(suffix, tmp_path):
    """As docs/howto/stimuli.md states, without this package."""
    stimuli, screen = (
        choose_stimuli(["looming-in-grating-80-per-m-contrast-1-light"]),
        set_screen(30.0, (99, 71)),
    )
    (entry,) = write_stimuli(tmp_path, stimuli, screen, suffix=suffix)["stimuli"].values()
    ffmpeg("-i", tmp_path / entry["video"], "-f", "rawvideo", "-pix_fmt", "gray", tmp_path / "raw")
    assert hashlib.sha256((tmp_path / "raw").read_bytes()).hexdigest() == entry["frames_sha256"]


def test_a_picture_of_the_user_is_the_panorama(tmp_path, capsys):
    pixels = np.tile(np.arange(0, 200, 2, dtype=np.uint8), (50, 1))
    Image.fromarray(pixels).save(tmp_path / "view.png")
    out = tmp_path / "out"
    assert run("panorama", "--size", 80, 40, "--picture", tmp_path / "view.png", "--out", out) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    assert manifest["picture"] == {
        "file": "view.png",
        "sha256": hashlib.sha256((tmp_path / "view.png").read_bytes()).hexdigest(),
    }
    assert manifest["stimuli"]["panorama"]["background"] == {"type": "Panorama", "speed": 0.05}
    frame = luma(next(iter(VideoReader(out / "panorama.mkv"))))
    assert (np.diff(frame[20].astype(int)) >= 0).all()  # the ramp of the picture
    assert np.ptp(frame[20]) > 150
    capsys.readouterr()


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "set"
    folder.mkdir()
    write_stimuli(folder, choose_stimuli(["grating-40-per-m-1hz"]), set_screen(5.0, (30, 20)))
    return folder


def overwrite(folder, name, *pair):
    path = folder / name
    path.write_text(path.read_text(encoding="utf-8").replace(*pair), encoding="utf-8")


def other_frames(folder):
    video = folder / "grating-40-per-m-1hz.mkv"
    frames = [luma(picture) for picture in VideoReader(video)]
    frames[7][3, 4] ^= 1
    video.unlink()
    with VideoWriter(video, 5.0, lossless=True) as writer:
        for frame in frames:
            writer.write(frame)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (other_frames, "grating-40-per-m-1hz.mkv' differs from the manifest: SHA-256"),
        (lambda path: overwrite(path, "grating-40-per-m-1hz.csv", "none", "no"), "1hz.csv' differs from the"),
        (lambda path: (path / "grating-40-per-m-1hz.mkv").unlink(), "does not exist"),
        (lambda path: (path / "grating-40-per-m-1hz.csv").unlink(), "cannot be read: No such file"),
        (lambda path: (path / "manifest.json").unlink(), "manifest.json' cannot be read"),
        (lambda path: overwrite(path, "manifest.json", '"stimuli"', '"films"'), "is not a manifest of lgmd"),
        (lambda path: overwrite(path, "manifest.json", "{", "["), "is not a manifest of lgmd-gym"),
        (lambda path: overwrite(path, "manifest.json", "1hz\": {", "x\": {"), "the hash of the set differs"),
    ],
)  # fmt: skip
def test_a_damaged_folder_is_refused(damage, message, folder, capsys):
    damage(folder)
    assert run("--check", folder) == 2
    printed = capsys.readouterr().err
    assert printed.startswith("lgmd-gym: ")
    assert printed.count("\n") == 1
    assert message in printed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["loming-square-dark-100ms"], "did you mean 'looming-square-dark-100ms'"),
        (["--fps", "0"], "--fps must be in [1, 1000] Hz, got 0.0"),
        (["--size", "2", "40"], "--size must be WIDTH HEIGHT, each 3 to 16384 px, got (2, 40)"),
        (["--suffix", "mp4"], "mp4"),
        (["--picture", "nowhere.png"], "picture 'nowhere.png' cannot be read"),
        (["--check", "nowhere", "--fps", "18"], "--check nowhere writes nothing; remove the other options"),
    ],
)
def test_invalid_options_give_one_line_and_write_nothing(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(*arguments) == 2
    printed = capsys.readouterr().err
    assert printed.startswith("lgmd-gym: ")
    assert printed.count("\n") == 1
    assert message in printed
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_command_leaves_no_folder(tmp_path, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(stimulus_files, "_write_stimulus", interrupt)
    assert run("panorama", "--out", tmp_path / "out") == 130
    assert list(tmp_path.iterdir()) == []


def test_a_lossless_video_takes_grey_pictures_only(tmp_path):
    with pytest.raises(ValueError, match=re.escape("lossless video must have a suffix among .mkv, .y4m")):
        VideoWriter(tmp_path / "film.mp4", 30.0, lossless=True)
    writer = VideoWriter(tmp_path / "film.mkv", 30.0, lossless=True)
    with pytest.raises(ValueError, match=re.escape("uint8 of shape (height, width), got uint8 (4, 4, 3)")):
        writer.write(np.zeros((4, 4, 3), np.uint8))
