"""The doctor finds a sound machine sound, and each fault that is put in."""

import pytest

from lgmd_gym.cli import checks as doctor
from lgmd_gym.cli import main as cli


def states(findings):
    return {item.check: item.state for item in findings}


def test_a_sound_machine(capsys, monkeypatch):
    monkeypatch.setattr(doctor, "SELF_TEST", 0.2)
    assert cli.run(["doctor"]) == 0
    said = capsys.readouterr().out
    for words in ("numba 0", "__pycache__", "ffmpeg", "m short", "camera frames/s"):
        assert words in said
    assert "fault" not in said


@pytest.mark.parametrize(
    ("asked", "words"),
    [("numpy>=99", "needs >=99"), ("no-such-package-here>=1", "no-such-package-here is missing")],
)
def test_wrong_versions(asked, words, monkeypatch):
    monkeypatch.setattr(doctor, "requires", lambda package: [asked, 'torch>=99; extra == "train"'])
    (fault,) = [item for item in doctor.check_versions() if item.state == doctor.FAULT]
    assert words in fault.words
    assert "pip install" in fault.mend


def test_no_codec(monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/nowhere/ffmpeg")
    found = list(doctor.examine_one("video"))
    assert states(found) == {"video": doctor.FAULT}
    assert "imageio-ffmpeg" in found[0].mend


def test_no_cache(monkeypatch):
    monkeypatch.setattr(doctor, "_cache_folder", lambda module: "/proc/nowhere")
    (fault,) = doctor.check_cache()
    assert fault.state == doctor.FAULT
    assert "set NUMBA_CACHE_DIR" in fault.mend


def test_a_brake_that_does_not_hold(monkeypatch):
    monkeypatch.setattr(doctor, "SELF_TEST", 0.01)
    monkeypatch.setattr(doctor, "_approach", lambda name: ((True, 0.0), 10))
    assert states(doctor.check_drive())["self-test"] == doctor.FAULT


def test_a_drive_that_ends_in_two_ways(monkeypatch):
    gaps = iter(range(1000))
    monkeypatch.setattr(doctor, "SELF_TEST", 0.01)
    monkeypatch.setattr(doctor, "_approach", lambda name: ((name == "no-brake", float(next(gaps, 0))), 10))
    (fault,) = [item for item in doctor.check_drive() if item.state == doctor.FAULT]
    assert "two ways" in fault.words


def test_faults_make_exit_code_one(monkeypatch, capsys):
    def fail():
        raise OSError("the [disk] is gone")

    monkeypatch.setattr(doctor, "CHECKS", {"disk": fail})
    assert cli.run(["doctor"]) == 1
    assert "the [disk] is gone" in capsys.readouterr().out
