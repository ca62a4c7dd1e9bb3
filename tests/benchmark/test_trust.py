"""Code from outside the package: loaded only if the user names or trusts it."""

import sys

import pytest

from lgmd_gym.agents.registry import outside_code
from lgmd_gym.cli import main as cli

SUITE = """
name = "tiny"
[[cases]]
family = "EmptyRoad"
speeds_kmh = [30]
"""
PAYLOAD = """
from pathlib import Path
Path(__file__).with_name("loaded").touch()
class Brakes:
    def act(self, observation, info):
        return -1.0
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A complete run of an agent whose module leaves a file when it is imported."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "tiny.toml").write_text(SUITE)
    (tmp_path / "payload.py").write_text(PAYLOAD)
    options = ["--agents", "payload:Brakes", "--seeds", "1", "--no-plots", "--no-report", "--jobs", "1"]
    assert cli.run(["bench", "--suite", "tiny.toml", "--out", "run", *options]) == 0
    forget(tmp_path)
    yield tmp_path / "run"
    sys.modules.pop("payload", None)


def forget(path):
    del sys.modules["payload"]
    (path / "loaded").unlink()


def resume(folder, *options):
    return cli.run(["bench", "--resume", str(folder), "--jobs", "1", "--no-plots", *options])


def test_complete_run_is_reported_without_its_agents(folder, tmp_path, capsys):
    assert resume(folder) == 0
    assert not (tmp_path / "loaded").exists()
    page = (folder / "report.html").read_text()
    assert "No camera frames of payload:Brakes" in page
    assert page.count("<figure><figcaption>tiny/EmptyRoad/v30") == 1  # the false activation, without a frame
    assert resume(folder, "--trust") == 0
    assert (tmp_path / "loaded").exists()
    page = (folder / "report.html").read_text()
    assert "No camera frames" not in page
    assert page.count('<figure><img src="data:image/jpeg') >= 2


def test_incomplete_run_loads_its_agents_only_if_trusted(folder, tmp_path, capsys):
    file = folder / "episodes.jsonl"
    lines = file.read_text().splitlines(keepends=True)
    file.write_text(lines[0])
    assert resume(folder) == 2
    message = capsys.readouterr().err
    assert "names agent 'payload:Brakes', which runs the code of module 'payload'" in message
    assert message.count("\n") == 1
    assert not (tmp_path / "loaded").exists()
    assert resume(folder, "--no-report", "--trust") == 0
    assert "lgmd-gym: loading module 'payload', named in" in capsys.readouterr().err
    assert (tmp_path / "loaded").exists()
    assert file.read_text().splitlines(keepends=True) == lines


def test_config_file_loads_its_agents_only_if_trusted(folder, tmp_path, capsys):
    assert cli.run(["bench", "--config", str(folder / "run.toml"), "--out", "again"]) == 2
    assert "add --trust" in capsys.readouterr().err
    assert not (tmp_path / "loaded").exists()
    assert not (tmp_path / "again").exists()


@pytest.mark.parametrize(
    ("agent", "code"),
    [
        ("spike-threshold:threshold=45", None),
        ("stopping-zone", None),
        ("policy:all-round", None),
        ("policy:all-round.zip", "policy file 'all-round.zip'"),
        ("policy:../x/policy.zip", "policy file '../x/policy.zip'"),
        ("policy:all-round:margin=1", None),
        ("policy:my.zip:margin=1", "policy file 'my.zip'"),
        ("policy:C:/runs/lr=0.01/policy.zip", "policy file 'C:/runs/lr=0.01/policy.zip'"),
        ("os:system", "module 'os'"),
        ("a.b:Class:speed=3", "module 'a.b'"),
    ],
)
def test_code_from_outside_the_package_is_known_by_its_name(agent, code):
    assert outside_code(agent) == code
