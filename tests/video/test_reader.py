"""Tests of reading and writing video files."""

import time

import numpy as np
import pytest
from support.clips import ffmpeg, make_test_clip, truncate

from lgmd_gym.clips import TruncatedVideoError, VideoReader, VideoWriter, find_clips, luma
from lgmd_gym.clips.video import SUFFIXES, probe


def test_luma_is_bt601():
    picture = np.random.default_rng(0).integers(0, 256, (7, 9, 3), np.uint8)
    np.testing.assert_array_equal(luma(picture), np.rint(picture @ np.array([0.299, 0.587, 0.114])))
    assert luma(np.full((3, 3, 3), 255, np.uint8)).max() == 255


def test_grey_values_are_lossless_in_every_iteration(clip, looming):
    reader = VideoReader(clip)
    assert (reader.fps, reader.total, reader.info.variable) == (30.0, 60, False)
    for _ in range(2):
        np.testing.assert_array_equal([luma(picture) for picture in reader], looming)


@pytest.mark.parametrize(
    ("suffix", "options", "shape"),
    [
        ("mkv", (), (48, 64)),
        ("mkv", ("-c:v", "libx264", "-pix_fmt", "yuv420p10le"), (48, 64)),
        ("mkv", ("-vf", "scale=51:37", "-c:v", "ffv1"), (37, 51)),
        ("mkv", ("-c:v", "libx264", "-bf", "3", "-g", "10"), (48, 64)),
        ("avi", ("-c:v", "libx264", "-bf", "3", "-pix_fmt", "yuv420p"), (48, 64)),
        ("ts", (), (48, 64)),
        ("gif", (), (48, 64)),
    ],
    ids=["default", "ten bits", "odd size", "reordered", "no time stamps", "late start", "gif"],
)
def test_every_frame_is_read_once(tmp_path, suffix, options, shape):
    path = make_test_clip(tmp_path / f"clip.{suffix}", *options)
    reader = VideoReader(path)
    pictures = list(reader)
    assert {picture.shape for picture in pictures} == {(*shape, 3)}
    assert len(pictures) == reader.total == 30
    assert not reader.info.variable
    assert reader.fps == pytest.approx(30.0, rel=4e-3 if suffix == "gif" else 1e-3)  # GIF: ticks of 10 ms
    assert len(list(VideoReader(path, fps=15.0))) == 15


@pytest.mark.parametrize("angle", [90, 180, 270])
def test_pictures_are_rotated_upright(tmp_path, angle):
    """The angle in the metadata is counterclockwise."""
    original = make_test_clip(tmp_path / "original.mp4", "-pix_fmt", "yuv420p")
    rotated = tmp_path / "rotated.mp4"
    ffmpeg("-display_rotation", angle, "-i", original, "-c", "copy", rotated)
    expected = np.rot90(next(iter(VideoReader(original))), angle // 90).astype(int)
    # Rotation precedes the conversion of subsampled colours, so the pictures are not equal to the bit.
    assert np.abs(next(iter(VideoReader(rotated))) - expected).mean() < 2.0


@pytest.mark.parametrize(
    ("options", "show"),
    [
        (("-display_hflip",), lambda picture: picture[:, ::-1]),
        (("-display_vflip",), lambda picture: picture[::-1]),
        (("-display_rotation", "90", "-display_hflip"), lambda picture: np.rot90(picture)[:, ::-1]),
        (("-display_rotation", "-90", "-display_hflip"), lambda picture: np.rot90(picture, -1)[:, ::-1]),
        (("-display_rotation", "180", "-display_vflip"), lambda picture: picture[:, ::-1]),
    ],
)
def test_mirrored_display_matrices(tmp_path, options, show):
    """The 8 combinations of quarter turns and mirrors; ffmpeg itself shows the same picture."""
    original = make_test_clip(tmp_path / "wide.mp4", source="testsrc2=size=64x48:rate=30:duration=0.1")
    path, shown = tmp_path / "mirrored.mp4", tmp_path / "shown.y4m"
    ffmpeg(*options, "-i", original, "-c", "copy", path)
    ffmpeg("-i", path, "-frames:v", "1", shown)
    (first, *_) = VideoReader(original)
    (found, *_), (expected, *_) = VideoReader(path), VideoReader(shown)
    assert np.abs(luma(found).astype(int) - luma(expected)).max() <= 1
    turned = show(luma(first))
    assert np.abs(luma(found).astype(int) - turned).max() <= 1


def test_a_slanted_display_matrix_is_refused(tmp_path):
    original = make_test_clip(tmp_path / "wide.mp4", source="testsrc2=size=64x48:rate=30:duration=0.1")
    ffmpeg("-display_rotation", "30", "-i", original, "-c", "copy", tmp_path / "slanted.mp4")
    with pytest.raises(ValueError, match="no combination of quarter turns and mirrors"):
        next(iter(VideoReader(tmp_path / "slanted.mp4")))


GAP = "select='not(between(t,1,1.99))',setpts=PTS"  # of 3 s at 30 Hz


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("gap.avi", ("-c:v", "ffv1")),
        ("gap.mp4", ()),
        ("gap.mkv", ("-c:v", "ffv1")),
    ],
)
def test_frames_keep_their_times_in_every_format(tmp_path, name, options):
    """A second is missing: the frames after it are at 2 s and later, not at 1 s, and the clip has 3 s."""
    path = tmp_path / name
    ffmpeg("-f", "lavfi", "-i", "testsrc2=size=64x48:rate=30:duration=3", "-vf", GAP, "-fps_mode", "vfr",
           *options, path)  # fmt: skip
    whole = make_test_clip(
        tmp_path / "whole.mkv", "-c:v", "ffv1", source="testsrc2=size=64x48:rate=30:duration=3"
    )
    info, pictures, full = probe(path), list(VideoReader(path)), list(VideoReader(whole))
    assert (info.frames, info.variable, info.fps) == (60, True, 30.0)
    assert info.duration == pytest.approx(3.0, abs=0.001)
    assert (info.time_of(29), info.time_of(30)) == pytest.approx((29 / 30, 2.0), abs=0.001)
    assert (info.frame_at(2.4), info.frame_at(1.9), info.frame_at(3.0)) == (42, 30, 60)
    assert len(pictures) == 90
    for number in (0, 29, 61, 75, 89):
        assert np.abs(luma(pictures[number]).astype(int) - luma(full[number])).mean() < 4.0


def test_one_missing_frame_in_ticks_of_a_frame(tmp_path):
    """AVI counts frames: an interval of two ticks is a missing frame, and not a lower frame rate."""
    path = tmp_path / "gap.avi"
    ffmpeg("-f", "lavfi", "-i", "testsrc2=size=64x48:rate=30:duration=1", "-vf", "select='not(eq(n,20))'",
           "-fps_mode", "vfr", "-c:v", "ffv1", path)  # fmt: skip
    info = probe(path)
    assert (info.frames, info.fps, info.variable) == (29, 30.0, True)
    assert (info.time_of(19), info.time_of(20), info.duration) == pytest.approx((19 / 30, 21 / 30, 1.0))
    assert len(list(VideoReader(path))) == 30


def test_frames_out_of_order_without_times_of_display(tmp_path):
    """AVI numbers the packets: with B frames, the picture before the gap may take the number after it."""
    path = tmp_path / "gap.avi"
    ffmpeg("-f", "lavfi", "-i", "testsrc2=size=64x48:rate=30:duration=3", "-vf", GAP, "-fps_mode", "vfr",
           "-c:v", "mpeg4", "-bf", "2", path)  # fmt: skip
    info = probe(path)
    assert (info.frames, info.variable) == (60, True)
    assert info.duration == pytest.approx(3.0, abs=0.04)
    assert info.time_of(32) == pytest.approx(2.07, abs=0.04)
    assert len(list(VideoReader(path))) == pytest.approx(90, abs=1)


def test_resampling_selects_the_nearest_frames_and_scaling_averages_pixels(clip, looming):
    reader = VideoReader(clip, fps=10.0, size=(48, 24))
    pictures = [luma(picture) for picture in reader]
    assert len(pictures) == reader.total == 20
    halved = np.array(looming[1::3], float).reshape(20, 24, 2, 48, 2).mean((2, 4))
    assert np.abs(pictures - halved).max() <= 1.0


def test_a_variable_frame_rate_is_detected_and_resampled(tmp_path):
    path = tmp_path / "variable.mkv"
    dropped = "select='not(eq(n\\,7)+between(n\\,12\\,15))'"
    make_test_clip(path, "-vf", dropped, "-fps_mode", "vfr", "-c:v", "ffv1")
    info = probe(path)
    assert (info.variable, info.frames) == (True, 25)
    assert info.fps == pytest.approx(30.0, rel=1e-3)
    pictures = list(VideoReader(path))
    assert len(pictures) == 30
    assert all((pictures[number] == pictures[11]).all() for number in (12, 13, 14, 15))


def test_a_frame_rate_of_30000_over_1001(tmp_path):
    path = make_test_clip(tmp_path / "ntsc.mp4", source="testsrc2=size=64x48:rate=30000/1001:duration=1")
    assert probe(path).fps == pytest.approx(30000 / 1001, abs=1e-4)
    assert not probe(path).variable


@pytest.mark.parametrize(
    ("suffix", "options"),
    [("mkv", ("-c:v", "ffv1")), ("mp4", ("-movflags", "faststart", "-c:v", "mpeg4", "-q:v", "2"))],
)
def test_a_truncated_file_yields_its_frames_and_raises(tmp_path, suffix, options):
    path = truncate(make_test_clip(tmp_path / f"clip.{suffix}", *options), 0.6)
    pictures = []
    with pytest.raises(TruncatedVideoError, match=r"it ends after \d+ of 30 frames"):
        pictures.extend(VideoReader(path))
    assert 5 < len(pictures) < 28
    with pytest.raises(TruncatedVideoError, match=f"after {len(pictures)} of"):
        list(VideoReader(path))


def test_a_longer_sound_track_is_not_a_truncated_video(tmp_path):
    path = tmp_path / "sound.mkv"
    video, sound = "testsrc2=size=64x48:rate=30:duration=1", "sine=duration=3"
    ffmpeg("-f", "lavfi", "-i", video, "-f", "lavfi", "-i", sound, path)
    assert len(list(VideoReader(path))) == 30


def test_a_damaged_frame_does_not_end_the_video(tmp_path):
    path = make_test_clip(tmp_path / "clip.mp4", "-c:v", "mpeg4", "-g", "5")
    data = bytearray(path.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 40] = bytes(40)
    path.write_bytes(data)
    assert len(list(VideoReader(path))) == pytest.approx(30, abs=2)


def test_closing_an_iterator_early_is_immediate(tmp_path):
    path = make_test_clip(tmp_path / "clip.mkv", source="testsrc2=size=320x240:rate=30:duration=20")
    pictures = iter(VideoReader(path))
    next(pictures)
    start = time.process_time()
    pictures.close()
    assert time.process_time() - start < 0.2  # decoding the rest takes longer


def test_find_clips_lists_the_video_files_of_folders(tmp_path, clip):
    for name in (
        "b.mp4",
        "a.mkv",
        "notes.txt",
        "._b.mp4",
        ".hidden.avi",
        "c.MTS",
        "d.m2ts",
        "e.wmv",
        "f.mpeg",
    ):
        (tmp_path / name).touch()
    assert [path.name for path in find_clips([tmp_path, clip])] == [
        *("a.mkv", "b.mp4", "c.MTS", "d.m2ts", "e.wmv", "f.mpeg", "loom.mkv")
    ]
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match=r"contains no video file .* use --recursive"):
        find_clips([tmp_path / "empty"])


def test_find_clips_in_folders_of_a_folder(tmp_path):
    for name in (
        "b/1.mp4",
        "a/2.mkv",
        "a/deep/3.avi",
        ".hidden/4.mp4",
        "a/.cache/5.mp4",
        "a/._2.mkv",
        "0.mov",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "a" / "loop").symlink_to(tmp_path)
    found = [path.relative_to(tmp_path).as_posix() for path in find_clips([tmp_path], recursive=True)]
    assert found == ["0.mov", "a/2.mkv", "a/deep/3.avi", "b/1.mp4"]
    assert [path.name for path in find_clips([tmp_path])] == ["0.mov"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(ValueError, match=r"contains no video file \(.*\)$"):
        find_clips([tmp_path / "empty"], recursive=True)


@pytest.mark.parametrize("argument", [{"fps": 0.0}, {"fps": float("nan")}, {"size": (2, 9)}])
def test_invalid_arguments_are_rejected(clip, argument):
    with pytest.raises(ValueError, match="must be"):
        VideoReader(clip, **argument)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_written_pictures_are_read_back(tmp_path, suffix, looming):
    pictures = [np.repeat(frame[:, :, None], 3, 2) for frame in looming]
    with VideoWriter(tmp_path / f"clip{suffix}", fps=25.0) as writer:
        for picture in pictures:
            writer.write(picture)
    reader = VideoReader(writer.path)
    assert reader.fps == pytest.approx(25.0)
    difference = np.array(list(reader), float) - pictures
    blocks = difference.reshape(60, 12, 4, 24, 4, 3).mean((2, 4))  # a GIF has 256 colours and is dithered
    assert np.abs(blocks).mean() < (6.0 if suffix == ".gif" else 1.5)


def test_quality_sets_the_file_size(tmp_path):
    pictures = np.random.default_rng(0).integers(0, 256, (5, 64, 64, 3), np.uint8)
    sizes = []
    for quality in (2.0, 8.0):
        with VideoWriter(tmp_path / f"{quality}.mp4", 30.0, quality) as writer:
            for picture in pictures:
                writer.write(picture)
        sizes.append(writer.path.stat().st_size)
    assert sizes[1] > 2 * sizes[0]


def test_the_writer_rejects_invalid_files_and_pictures(tmp_path, clip):
    for path, message in (
        (clip, "exists; choose another file"),
        (tmp_path / "clip.txt", "must have a suffix among .mp4"),
        (tmp_path / "nowhere" / "clip.mp4", "does not exist; create it first"),
    ):
        with pytest.raises(ValueError, match=message):
            VideoWriter(path, 30.0)
    with (
        VideoWriter(tmp_path / "odd.mp4", 30.0) as writer,
        pytest.raises(ValueError, match="even, got 5×4 px"),
    ):
        writer.write(np.zeros((4, 5, 3), np.uint8))
    with VideoWriter(tmp_path / "sizes.mp4", 30.0) as writer:
        writer.write(np.zeros((32, 32, 3), np.uint8))
        with pytest.raises(ValueError, match="32×32 px, got 16×32"):
            writer.write(np.zeros((32, 16, 3), np.uint8))
