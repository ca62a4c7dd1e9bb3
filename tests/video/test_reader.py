"""Real video: every file that ffmpeg reads, of any kind of brokenness."""

import time

import numpy as np
import pytest
from support.clips import broken, ffmpeg, synthesize

from lgmd_gym.video import Reading, TruncatedVideoError, VideoReader, VideoWriter, find_clips, luma
from lgmd_gym.video.probe import probe


def test_luma_is_bt601():
    picture = np.random.default_rng(0).integers(0, 256, (7, 9, 3), np.uint8)
    assert (luma(picture) == np.rint(picture @ np.array([0.299, 0.587, 0.114]))).all()
    assert luma(np.full((3, 3, 3), 255, np.uint8)).max() == 255


def test_grey_pictures_come_back_as_they_were(clip, looming):
    reader = VideoReader(clip)
    assert (reader.fps, reader.total, reader.info.variable) == (30.0, 60, False)
    for _ in range(2):  # it can be read again
        read = [luma(picture) for picture in reader]
        assert len(read) == len(looming)
        assert all((a == b).all() for a, b in zip(read, looming, strict=True))


@pytest.mark.parametrize(
    ("options", "shape"),
    [
        ((), (48, 64)),
        (("-c:v", "libx264", "-pix_fmt", "yuv420p10le"), (48, 64)),
        (("-vf", "scale=51:37", "-c:v", "ffv1"), (37, 51)),
        (("-c:v", "libx264", "-bf", "3", "-g", "10"), (48, 64)),
    ],
    ids=["plain", "ten bits", "odd size", "reordered"],
)
def test_every_frame_comes_once(tmp_path, options, shape):
    path = synthesize(tmp_path / "clip.mkv", *options)
    reader = VideoReader(path)
    pictures = list(reader)
    assert {picture.shape for picture in pictures} == {(*shape, 3)}
    assert len(pictures) == reader.total == 30
    assert reader.fps == pytest.approx(30.0, rel=1e-3)


def test_a_rotated_clip_comes_upright(tmp_path):
    flat = synthesize(tmp_path / "flat.mp4", "-pix_fmt", "yuv420p")
    ffmpeg("-display_rotation", "90", "-i", flat, "-c", "copy", tmp_path / "turned.mp4")
    assert next(iter(VideoReader(flat))).shape == (48, 64, 3)
    assert next(iter(VideoReader(tmp_path / "turned.mp4"))).shape == (64, 48, 3)


def test_resampling_and_scaling(clip):
    reader = VideoReader(clip, Reading(fps=18.0, size=(40, 21)))
    pictures = list(reader)
    assert pictures[0].shape == (21, 40, 3)
    assert len(pictures) == reader.total == 36


def test_a_variable_rate_is_found_and_resampled(tmp_path):
    path = tmp_path / "variable.mkv"
    choose = "select='not(eq(n\\,7)+between(n\\,12\\,15))'"
    synthesize(path, "-vf", choose, "-fps_mode", "vfr", "-c:v", "ffv1")
    info = probe(path)
    assert info.variable
    assert info.frames == 25
    assert info.fps == pytest.approx(30.0, rel=0.02)
    assert len(list(VideoReader(path))) == pytest.approx(30, abs=1)


def test_a_rate_of_30000_over_1001(tmp_path):
    path = synthesize(tmp_path / "ntsc.mp4", source="testsrc2=size=64x48:rate=30000/1001:duration=1")
    assert probe(path).fps == pytest.approx(30000 / 1001, abs=1e-4)
    assert not probe(path).variable


@pytest.mark.parametrize(
    ("suffix", "options"),
    [("mkv", ("-c:v", "ffv1")), ("mp4", ("-movflags", "faststart", "-c:v", "mpeg4", "-q:v", "2"))],
)
def test_a_truncated_file_gives_what_there_is_and_says_so(tmp_path, suffix, options):
    path = broken(synthesize(tmp_path / f"clip.{suffix}", *options), 0.6)
    seen = []
    with pytest.raises(TruncatedVideoError, match=r"breaks off after \d+ of 30 frames"):
        seen.extend(map(luma, VideoReader(path)))
    with pytest.raises(TruncatedVideoError, match=f"after {len(seen)} of"):
        list(VideoReader(path))
    assert 5 < len(seen) < 28


def test_leaving_a_reader_early_ends_its_ffmpeg(tmp_path):
    path = synthesize(tmp_path / "clip.mkv", source="testsrc2=size=320x240:rate=30:duration=20")
    pictures = iter(VideoReader(path))
    next(pictures)
    begun = time.perf_counter()
    pictures.close()
    assert time.perf_counter() - begun < 1.0


def test_find_clips(tmp_path, clip):
    for name in ("b.mp4", "a.mkv", "notes.txt"):
        (tmp_path / name).touch()
    assert [path.name for path in find_clips([tmp_path, clip])] == ["a.mkv", "b.mp4", "loom.mkv"]


@pytest.mark.parametrize("field", [{"fps": 0.0}, {"fps": float("nan")}, {"size": (2, 9)}])
def test_impossible_readings_are_refused(field):
    with pytest.raises(ValueError, match="must"):
        Reading(**field)


def test_a_video_writer_still_refuses_what_exists(tmp_path, clip):
    with pytest.raises(ValueError, match="exists and is kept"):
        VideoWriter(clip, 30.0)
