"""Failed episodes: a line per exception with its place, and the early end of a run."""

import pytest

from lgmd_gym import benchmark
from lgmd_gym.benchmark.runner import EARLY, MAX_FAILURES, failing_agent, failure_lines
from lgmd_gym.cli import main as cli

MODULE = """
class Broken:
    def act(self, observation, info):
        return helper(observation)

def helper(observation):
    return observation["frame"].mean()
"""


def row(agent, error=None):
    return {"agent": agent, "error": error}


@pytest.fixture
def module(tmp_path, monkeypatch):
    (tmp_path / "broken_agents.py").write_text(MODULE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)


def test_a_run_ends_early_if_every_episode_of_an_agent_fails(module, tmp_path, capsys):
    agents = ["broken_agents:Broken", "always-brake"]
    out = ["--out", str(tmp_path / "run"), "--no-report", "--no-plots"]
    assert (
        cli.run(["bench", "--agents", *agents, "--seeds", "1", "--jobs", "1", "--suite", "quick", *out]) == 1
    )
    printed = " ".join(capsys.readouterr().out.split())
    assert f"{EARLY} episodes failed" in printed
    assert "- broken_agents:Broken: KeyError: \"unknown observation key 'frame'; " in printed
    assert (
        'set include_frame = True in the class for camera frames" at broken_agents.py:7 in helper' in printed
    )
    assert f"every episode of broken_agents:Broken failed, {EARLY} so far: {19 + EARLY} of 57" in printed
    assert "start a new run" in printed


def test_a_run_goes_on_if_some_episodes_succeed():
    rows = [row("a"), *[row("a", "E: x")] * 20, *[row("b", "E: x")] * (EARLY - 1)]
    assert failing_agent(rows) == ""
    assert failing_agent([*rows, row("b", "E: x")]) == "b"


def test_failures_are_grouped_and_counted():
    trace = 'Traceback (most recent call last):\n  File "/x/{}.py", line 3, in act\n    x\n{}\n'
    rows = [row("a", trace.format("one", "ValueError: 1")) for _ in range(3)]
    rows += [row("b", trace.format(number, "ZeroDivisionError")) for number in range(9)]
    first, *others, last = failure_lines([*rows, row("c")])
    assert first == "a: ValueError: 1 at /x/one.py:3 in act (3 episodes)"
    assert len(others) == MAX_FAILURES - 1
    assert last == "5 other failures"


def test_the_place_is_in_the_code_of_the_user():
    package = benchmark.__file__
    trace = (
        f'Traceback:\n  File "{package}", line 1, in play\n    x\n  File "/home/me/agent.py", line 7, in a\n'
        '    x\n  File "/v/site-packages/numpy/core.py", line 9, in mean\n    x\nTypeError: no\n'
    )
    assert failure_lines([row("a", trace)]) == ["a: TypeError: no at /home/me/agent.py:7 in a (1 episode)"]
