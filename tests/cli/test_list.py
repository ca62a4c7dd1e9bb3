"""The pager of `lgmd-gym list`, and the list of cases."""

import pydoc

import pytest

from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.cli import list as list_command
from lgmd_gym.cli import main as cli
from lgmd_gym.cli.console import make_console


@pytest.fixture
def paged(monkeypatch):
    """Texts that a pager shows."""
    texts = []
    monkeypatch.setattr(pydoc, "pager", texts.append)
    return texts


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setenv("LINES", "30")
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TERM", "xterm")
    console = make_console()
    console._force_terminal = True
    monkeypatch.setattr(list_command, "make_console", lambda: console)


def test_a_long_list_in_a_terminal_opens_in_a_pager(paged, terminal, capsys):
    assert cli.run(["list", "envs", "--pager"]) == 0
    assert len(paged) == 1
    assert "LGMD/CCRs-v0" in paged[0]
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("arguments", [["cameras", "--pager"], ["envs"]])
def test_a_short_list_or_no_pager_is_printed(arguments, paged, terminal, capsys):
    assert cli.run(["list", *arguments]) == 0
    assert paged == []
    assert capsys.readouterr().out


def test_a_pipe_has_no_pager(paged, capsys):
    assert cli.run(["list", "--pager"]) == 0
    assert paged == []
    assert "LGMD/CCRs-v0" in capsys.readouterr().out


def test_every_case_is_listed_by_its_whole_name(capsys):
    assert cli.run(["list", "cases"]) == 0
    words = set(capsys.readouterr().out.split())
    assert {case.name for suite in SUITES.values() for case in suite.cases} <= words
