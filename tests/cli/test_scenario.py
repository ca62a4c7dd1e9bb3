"""The commands `scenario new` and `scenario show`."""

import re

import pytest

from lgmd_gym.benchmark import get_suite
from lgmd_gym.benchmark.suites import template
from lgmd_gym.cli import main as cli


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capsys, *command):
    assert cli.run(["scenario", *command]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    return message


def test_template_is_a_valid_scenario(folder, capsys):
    assert cli.run(["scenario", "new"]) == 0
    assert "scenario.toml: edit it, then lgmd-gym scenario show scenario.toml" in capsys.readouterr().out
    (case,) = get_suite("scenario.toml").cases
    assert (case.name, len(case.scenario.actors)) == ("scenario/own/v70", 2)
    # The lane change ends in the ego's lane.
    bends = case.scenario.actors[0].path
    assert sum(bend.turn for bend in bends) == pytest.approx(0.0)


def test_every_commented_line_of_the_template_is_valid(folder):
    lines = re.findall(r"^# (\w+ = .*)$", template(), re.MULTILINE)
    assert len(lines) == 9
    for line in lines:
        text = template().replace(f"# {line}", line)
        if line.startswith(("family", "arguments")):
            text = "\n".join(item for item in lines if item.startswith(("family", "arguments")))
        (folder / "own.toml").write_text(text)
        assert get_suite("own.toml").cases


def test_files_are_replaced_with_force_only(folder, capsys):
    file = folder / "own.toml"
    file.write_text("mine")
    message = refused(capsys, "new", "own.toml")
    assert "scenario file 'own.toml' exists; choose another file, or replace it with --force" in message
    assert file.read_text() == "mine"
    assert cli.run(["scenario", "new", "own.toml", "--force"]) == 0
    assert file.read_text() == template()
    assert "must have the suffix .toml, got 'own.json'" in refused(capsys, "new", "own.json")
    assert "cannot be created" in refused(capsys, "new", "nowhere/own.toml")
    assert "scenario new writes one file, got 2" in refused(capsys, "new", "a.toml", "b.toml")


def test_show_draws_files_ids_and_cases(folder, capsys):
    cli.run(["scenario", "new", "own.toml"])
    assert cli.run(["scenario", "show", "own.toml"]) == 0
    assert "own.png: contact after" in capsys.readouterr().out
    assert (folder / "own.png").read_bytes()[:4] == b"\x89PNG"
    assert "picture 'own.png' exists; choose another file" in refused(capsys, "show", "own.toml")
    assert cli.run(["scenario", "show", "own.toml", "--force"]) == 0
    assert cli.run(["scenario", "show", "quick/EmptyRoad/v30"]) == 0
    assert "quick_EmptyRoad_v30.png: no contact after" in capsys.readouterr().out
    assert cli.run(["scenario", "show", "LGMD/CutIn-v0", "--set", "excess=-4", "--to", "cut.svg"]) == 0
    assert "cut.svg: contact" in capsys.readouterr().out
    assert (folder / "cut.svg").read_text().startswith("<?xml")


def test_show_refuses_what_it_cannot_draw(capsys):
    assert "scenario show needs a file, an environment id or a case" in refused(capsys, "show")
    assert "show needs one scenario, got 2" in refused(capsys, "show", "a.toml", "b.toml")
    assert "traffic/merge has no scenario to show" in refused(capsys, "show", "traffic/merge")
    assert "did you mean 'LGMD/CutIn-v0'" in refused(capsys, "show", "LGMD/CutIn")
    assert "cannot be read: No such file" in refused(capsys, "show", "missing.json")
