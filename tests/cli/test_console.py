"""The console prints names of users as they are, also those that look like rich's markup or emoji codes."""

import os
import subprocess
import sys
from io import StringIO

import pytest
from rich.table import Table
from support.rows import threat_row

from lgmd_gym.benchmark.analysis.tables import case_table, score_tables
from lgmd_gym.benchmark.traffic.rows import KEYS
from lgmd_gym.benchmark.traffic.summary import traffic_table
from lgmd_gym.cli.console import activity, make_console
from lgmd_gym.cli.doctor import FAULT, Finding, print_findings

NAMES = ["[red]a", "b[/]", ":x:"]


def scores():
    values = {"avoided": True, "premature_brake": False, "speed_reduction": 3.0, "fcw_driver": False}
    rows = [threat_row(agent=name, case=f"s/CCRs/{name}", **values) for name in NAMES]
    return [*score_tables(rows, NAMES, NAMES[1]), case_table(rows, NAMES)]


def traffic():
    zeros = dict.fromkeys(KEYS, 0) | {"case": "traffic/merge/s0", "condition": "clear", "error": None}
    rows = [zeros | {"agent": name, "kind": "merge", "distance": 1000.0, "side": ""} for name in NAMES]
    return [traffic_table(rows, NAMES, NAMES[1])]


def plain():
    table = Table(title=NAMES[0], caption=NAMES[1])
    table.add_column(NAMES[2])
    return [table]


@pytest.mark.parametrize("tables", [scores, traffic, plain])
def test_tables_show_names_literally(tables, capsys):
    for table in tables():
        make_console().print(table)
    printed = capsys.readouterr().out
    assert all(name in printed for name in NAMES)


def test_findings_show_messages_literally(capsys):
    print_findings([Finding("check", FAULT, NAMES[0], NAMES[1])], make_console())
    assert capsys.readouterr().out.splitlines() == ["fault check       [red]a", f"{'':18}→ b[/]"]


class Terminal(StringIO):
    def isatty(self):
        return True


def test_an_activity_is_shown_in_a_terminal_and_erased(monkeypatch):
    monkeypatch.setattr("sys.stderr", Terminal())
    with activity("loading [b]") as show:
        show("1.0 s :x:")
    written = sys.stderr.getvalue()
    assert "loading [b]" in written or "1.0 s :x:" in written
    assert written.endswith("\x1b[2K")  # the line is erased


def test_an_activity_writes_nothing_to_a_file_and_leaves_stdout_alone(monkeypatch, capsys):
    with activity("loading") as show:
        show("still loading")
        print("output")
    assert capsys.readouterr() == ("output\n", "")


def test_output_to_a_file_stays_there_during_an_activity_in_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr("sys.stderr", Terminal())
    with activity("loading"):
        print("output")
    assert capsys.readouterr().out == "output\n"


@pytest.mark.parametrize("columns", ["0", "-3", "wide", ""])
def test_a_width_that_is_none_is_replaced(monkeypatch, capsys, columns):
    monkeypatch.setenv("COLUMNS", columns)
    make_console().print("text")
    assert capsys.readouterr().out == "text\n"


@pytest.mark.parametrize("encoding", ["cp1252", "cp437", "latin-1", "ascii"])
def test_output_in_any_encoding(encoding):
    found = subprocess.run(
        [sys.executable, "-m", "lgmd_gym", "list", "agents"],
        env=os.environ | {"PYTHONIOENCODING": encoding},
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert (found.returncode, found.stderr) == (0, b"")
    assert b"stopping-zone" in found.stdout


@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-"])
def test_closed_streams(closed):
    command = f"{sys.executable} -m lgmd_gym list suites {closed}"
    assert subprocess.run(["sh", "-c", command], capture_output=True, timeout=60, check=False).returncode == 0


@pytest.mark.slow
@pytest.mark.parametrize("closed", ["<&-", "2>&-", ">&- 2>&-"])
def test_worker_processes_start_without_a_standard_stream(closed, tmp_path):
    options = "--suite r152 --agents no-brake --seeds 1 --worlds 0 --jobs 2 --no-plots"
    command = f"{sys.executable} -m lgmd_gym bench {options} --out {tmp_path / 'run'} {closed}"
    done = subprocess.run(["sh", "-c", command], capture_output=True, timeout=300, check=False)
    assert done.returncode == 0
    assert (tmp_path / "run" / "summary.csv").exists()
