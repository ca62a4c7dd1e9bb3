"""Files and folders that are complete or absent, and the commands that write them."""

import os
import subprocess
import sys
import time
from contextlib import suppress
from errno import ENOSPC
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lgmd_gym.cli import main as cli
from lgmd_gym.cli.values import default_out
from lgmd_gym.clips import VideoWriter, batch
from lgmd_gym.paper import claims, experiments, plots
from lgmd_gym.processes.files import LOCK_FILE, FolderLock, check_new_file, complete_file, complete_folder
from lgmd_gym.report.gallery import build


def names(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def test_a_file_is_replaced_at_the_end_only(tmp_path):
    file = tmp_path / "deep" / "file.txt"
    for text in ("old", "new"):
        with complete_file(file) as part:
            part.write_text(text)
            assert file.exists() is (text == "new")
        assert (file.read_text(), names(tmp_path)) == (text, ["deep", "deep/file.txt"])
    with suppress(OSError), complete_file(file) as part:
        part.write_text("half")
        raise OSError("disk full")
    assert (file.read_text(), names(tmp_path)) == ("new", ["deep", "deep/file.txt"])


def test_a_folder_appears_at_the_end_only(tmp_path):
    folder = tmp_path / "deep" / "run"
    with suppress(KeyboardInterrupt), complete_folder(folder, "run folder") as part:
        (part / "file").write_text("x")
        raise KeyboardInterrupt
    assert names(tmp_path) == ["deep"]
    with complete_folder(folder, "run folder") as part:
        (part / "file").write_text("x")
        assert not folder.exists()
    assert names(tmp_path) == ["deep", "deep/run", "deep/run/file"]
    with pytest.raises(ValueError, match="already exists; choose another --out"):
        complete_folder(folder, "run folder").__enter__()


def test_the_folder_of_a_killed_command_is_used_again(tmp_path):
    part = tmp_path / "run.part"
    (part / "deep").mkdir(parents=True)
    for name in ("old", "deep/old", LOCK_FILE):
        (part / name).touch()
    with complete_folder(tmp_path / "run", "run folder") as folder:
        assert names(folder) == [LOCK_FILE]
        (folder / "new").touch()
    assert names(tmp_path) == ["run", "run/new"]


def test_the_folder_of_a_running_command_is_kept(tmp_path):
    with complete_folder(tmp_path / "run", "run folder") as folder:
        (folder / "file").touch()
        with pytest.raises(ValueError, match=rf"run\.part' is in use by process {os.getpid()}; wait"):
            complete_folder(tmp_path / "run", "run folder").__enter__()
    assert names(tmp_path) == ["run", "run/file"]


def test_a_folder_of_another_origin_is_named_and_kept(tmp_path):
    (tmp_path / "run.part").mkdir()
    (tmp_path / "run.part" / "file").touch()
    with pytest.raises(ValueError, match=r"run\.part' is needed for unfinished results; remove it"):
        complete_folder(tmp_path / "run", "run folder").__enter__()
    assert names(tmp_path) == ["run.part", "run.part/file"]


def test_a_lock_that_was_removed_meanwhile_is_refused(tmp_path, monkeypatch):
    """As by the end of the command that held it, between opening and locking the file."""
    monkeypatch.setattr("fcntl.flock", lambda file, kind: (tmp_path / LOCK_FILE).unlink())
    with pytest.raises(ValueError, match="cannot be locked"):
        FolderLock(tmp_path)


def test_a_new_file_is_checked_and_not_made(tmp_path):
    check_new_file(tmp_path / "new", "--best")
    assert names(tmp_path) == []
    (tmp_path / "old").touch()
    for name, message in (("old", "exists"), ("no/file", "cannot be created"), ("x" * 300, "cannot be cre")):
        with pytest.raises(ValueError, match=f"--best .* {message}"):
            check_new_file(tmp_path / name, "--best")


@pytest.mark.parametrize(
    ("arguments", "module", "function"),
    [
        (["gallery", "--families", "CCRs"], build, "record_video"),
        (["paper"], experiments, "run_experiments"),
        (["paper"], plots, "paper_figures"),
        (["video"], batch, "csv"),
    ],
)
def test_an_interrupted_command_leaves_no_folder(arguments, module, function, clip, tmp_path, monkeypatch):
    class Interrupted:
        def __call__(self, *_):
            raise KeyboardInterrupt

        def __getattr__(self, name):
            raise KeyboardInterrupt

    monkeypatch.setattr(module, function, Interrupted())
    monkeypatch.setattr(experiments, "STEPS", 1)
    if function == "paper_figures":
        for name in ("evaluate_claims", "write_claims"):
            monkeypatch.setattr(claims, name, lambda *_: [])
        monkeypatch.setattr(experiments, "run_experiments", lambda *_: None)
    clips = [str(clip)] if arguments == ["video"] else []
    assert cli.run([*arguments, *clips, "--out", str(tmp_path / "out")]) == 130
    assert [name for name in names(tmp_path) if name.startswith("out")] == []


def test_an_input_or_output_error_is_one_line(monkeypatch, capsys):
    def fail(options):
        with complete_file(Path("/tmp/never")):
            raise OSError(ENOSPC, os.strerror(ENOSPC))

    monkeypatch.setattr("lgmd_gym.cli.list.run", fail)
    assert cli.run(["list"]) == 2
    assert capsys.readouterr().err == "lgmd-gym: '/tmp/never': No space left on device\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the device is Linux's")
def test_a_full_disk_behind_stdout_is_one_line():
    command = [sys.executable, "-m", "lgmd_gym", "list", "cameras"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert (done.returncode, done.stderr) == (2, "lgmd-gym: output failed: No space left on device\n")


def test_a_video_on_a_full_disk_is_removed(tmp_path):
    """The disk is full at the end of the file, or another error ends the block; Ctrl-C keeps the file."""
    for number, (error, kept) in enumerate(((ValueError, False), (KeyboardInterrupt, True))):
        path = tmp_path / f"{number}.gif"
        with suppress(error), VideoWriter(path, 10.0) as writer:
            writer.write(np.zeros((16, 16, 3), np.uint8))
            raise error
        assert path.exists() is kept
    if Path("/dev/full").exists():
        (tmp_path / "full.gif").symlink_to("/dev/full")
        writer = VideoWriter(tmp_path / "other.gif", 10.0)
        writer.path = tmp_path / "full.gif"
        with pytest.raises(OSError, match="No space left"), writer:
            writer.write(np.zeros((16, 16, 3), np.uint8))
        assert not writer.path.is_symlink()


def test_default_folders_of_one_second_differ(monkeypatch):
    times = iter([1_000_000_000_123_000_000, 1_000_000_000_124_000_000])
    clock = SimpleNamespace(time_ns=lambda: next(times), strftime=time.strftime, localtime=time.localtime)
    monkeypatch.setattr("lgmd_gym.cli.values.time", clock)
    first, second = default_out(None, "quick"), default_out(None, "quick")
    assert (first.name[-4:], second.name[-4:]) == ("-123", "-124")
    assert first.name[:-4] == second.name[:-4]
    assert first.parent == Path("runs")
    assert default_out(Path("mine"), "quick") == Path("mine")
