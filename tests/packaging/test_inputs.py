"""Files from anywhere: no device, pipe or huge file is read, and a byte order mark is no part of the text."""

import os
import zipfile
from pathlib import Path

import pytest

from lgmd_gym.benchmark.case_table import read_data
from lgmd_gym.cli.main import run as run_command
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.processes.inputs import check_members, read_bytes, read_json, read_text, read_toml

BOM = "\N{ZERO WIDTH NO-BREAK SPACE}"


@pytest.fixture
def pipe(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    return tmp_path / "pipe"


def test_only_regular_files_of_a_stated_size_are_read(tmp_path, pipe):
    file = tmp_path / "file"
    file.write_bytes(b"12345")
    assert read_bytes(file, 5) == read_bytes(file, None) == b"12345"
    with pytest.raises(OSError, match="it has 5 bytes, more than 4"):
        read_bytes(file, 4)
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(OSError, match="it is a device or pipe, not a regular file"):
            read_bytes(path)
    with pytest.raises(OSError, match="it is a folder"):
        read_bytes(tmp_path)
    with pytest.raises(OSError, match="it has more than 4 bytes"):
        read_bytes(Path("/proc/self/environ"), 4)  # its size is stated as 0


def test_text_toml_and_json(tmp_path):
    (tmp_path / "a.toml").write_text(f"{BOM}a = 1\n", "utf-8")
    (tmp_path / "a.json").write_text(BOM + '{"a": 1}', "utf-8")
    assert read_toml(tmp_path / "a.toml") == read_json(tmp_path / "a.json") == {"a": 1}
    assert read_text(tmp_path / "a.toml") == "a = 1\n"
    (tmp_path / "deep.json").write_text("[" * 200_000)
    with pytest.raises(ValueError, match="nested too deeply"):
        read_json(tmp_path / "deep.json")


def test_members_of_a_zip_file_have_a_limit(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as archive:
        archive.writestr("one", bytes(60))
        archive.writestr("two", bytes(60))
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        check_members(archive, 120)
        with pytest.raises(ValueError, match="it unpacks to 120 bytes, more than 119"):
            check_members(archive, 119)


def test_readers_of_parameters_and_suites(tmp_path, pipe):
    (tmp_path / "params.toml").write_text(f"{BOM}t_sf = 40.0\n", "utf-8")
    assert LGMDParams.from_toml(tmp_path / "params.toml").t_sf == 40.0
    for read in (LGMDParams.from_toml, lambda path: read_data(path, "params file")):
        with pytest.raises(ValueError, match=r"params file .*pipe' cannot be read: it is a device or pipe"):
            read(pipe)


@pytest.mark.parametrize(
    "arguments",
    [
        ["bench", "--agents", "spike-threshold:toml=PIPE"],
        ["bench", "--config", "PIPE"],
        ["bench", "--suite", "PIPE.toml"],
        ["bench", "--suite", "PIPE.xosc"],
        ["bench", "--params", "PIPE"],
        ["video", "PIPE"],
        ["scenario", "check", "PIPE.xosc"],
        ["scenario", "show", "PIPE.toml"],
        ["drive", "LGMD/CCRs-v0", "--agent", "policy:PIPE.zip"],
        ["train", "--hyperparams", "PIPE"],
    ],
)
def test_commands_do_not_wait_for_a_pipe(tmp_path, monkeypatch, capsys, arguments):
    monkeypatch.chdir(tmp_path)
    for suffix in ("", ".toml", ".xosc", ".zip"):
        os.mkfifo(f"PIPE{suffix}")
    assert run_command(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("lgmd-gym: ")
    assert "regular file" in line or "is not a file" in line, line
