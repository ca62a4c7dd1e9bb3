"""Playback of episodes: targets, results, and the live window."""

import os
import subprocess
import sys

import numpy as np
import pytest
from support.rollouts import HOLD

from lgmd_gym import LGMDView
from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.player import run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_case
from lgmd_gym.benchmark.task import Task
from lgmd_gym.cli import main as cli
from lgmd_gym.rendering.playback import make_target, play_episode
from lgmd_gym.rendering.window import DISPLAY_VARIABLES, Window

WINDOW = """
import gymnasium as gym, numpy as np, pygame, lgmd_gym
env = lgmd_gym.LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=8.0), render_mode="human")
env.reset(seed=0)
for _ in range(3):
    env.step([0.0])
shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
assert pygame.display.get_caption()[0] == "LGMD/CCRs-v0"
expected = lgmd_gym.LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=8.0), title="LGMD/CCRs-v0")
expected.reset(seed=0)
for _ in range(3):
    expected.step([0.0])
assert (shown == expected.render()).all()
pygame.event.post(pygame.event.Event(pygame.QUIT))
env.step([0.0])
assert not env.window.open
env.step([0.0])
env.close()
"""


@pytest.mark.slow
def test_window_shows_the_picture_until_it_is_closed():
    variables = {name: value for name, value in os.environ.items() if name not in DISPLAY_VARIABLES}
    result = subprocess.run(
        [sys.executable, "-c", WINDOW], capture_output=True, text=True, timeout=60,
        env={**variables, "SDL_VIDEODRIVER": "dummy"},
    )  # fmt: skip
    assert result.returncode == 0, result.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems always have a display")
def test_missing_display_is_reported_in_one_line(monkeypatch, capsys):
    for name in DISPLAY_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    assert cli.run(["drive", "LGMD/CCRs-v0", "--live"]) == 2
    message = capsys.readouterr().err
    assert message.count("\n") == 1
    assert "got neither DISPLAY nor WAYLAND_DISPLAY; write a file with --video" in message


def test_closing_the_window_stops_the_playback(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    shown = []

    def show(window, picture):
        shown.append(picture.shape)
        return len(shown) < 5

    monkeypatch.setattr(Window, "show", show)
    result = play_episode("LGMD/CCRs-v0", make_agent("no-brake"), 0, {}, live=True)
    assert result.stopped
    assert result.duration == pytest.approx(4 / 30)
    assert shown == [(720, 1280, 3)] * 5


def test_result_describes_the_end_of_the_episode():
    hit = play_episode("LGMD/CCRs-v0", make_agent("no-brake"), 0, {"ego_speed": 8.0})
    assert hit.collision
    assert not hit.stopped
    assert hit.impact_speed == pytest.approx(8.0, abs=0.01)
    assert hit.duration == pytest.approx(5.0, abs=0.1)
    stopped = play_episode("LGMD/CCRs-v0", make_agent("always-brake"), 0, {"ego_speed": 8.0})
    assert not stopped.collision
    assert stopped.ego_speed == pytest.approx(0.0, abs=1e-6)
    assert stopped.gap > 0.0


def test_world_and_condition_repeat_a_run_of_the_benchmark():
    sensors, agent = SensorConfig(), "stopping-zone"
    row = run_task(Task(agent, find_case("quick/CCRs/v30"), 3, sensors, condition="night", world=9003)).row
    surroundings = {"world": 9003, "weather": "night"}
    result = play_episode("quick/CCRs/v30", make_agent(agent), 3, {}, surroundings=surroundings)
    elsewhere = play_episode("quick/CCRs/v30", make_agent(agent), 3, {})
    assert (result.collision, result.duration) == (row["collision"], pytest.approx(row["duration"]))
    assert elsewhere.duration != result.duration


@pytest.mark.parametrize(
    ("target", "arguments", "message"),
    [
        ("traffic/merg", {}, "did you mean 'traffic/merge'"),
        ("traffic/merge", {"ego_speed": 5.0}, "must have no scenario arguments, got ego_speed"),
    ],
)
def test_invalid_targets_raise(target, arguments, message):
    with pytest.raises(ValueError, match=message):
        make_target(target, arguments)


@pytest.mark.parametrize("target", ["traffic/merge", "traffic-inattentive/merge", "LGMD/Traffic-Merge-v0"])
def test_the_bound_has_no_forecast_in_traffic(target):
    message = f"agent last-moment-oracle requires braking environments, got traffic {target}; use ttc-oracle"
    with pytest.raises(ValueError, match=message):
        play_episode(target, make_agent("last-moment-oracle"), 0, {})


@pytest.mark.parametrize(
    ("target", "identity"),
    [
        ("traffic/merge", "LGMD/Traffic-Merge-v0"),
        ("LGMD/Traffic-Merge-v0", "LGMD/Traffic-Merge-v0"),
        ("LGMD/RandomBraking-v0", "LGMD/RandomBraking-v0"),
        ("quick/CCRs/v30", "LGMD/CCRs-v0"),
    ],
)
def test_every_kind_of_target_can_be_displayed(target, identity):
    env = LGMDView(make_target(target, {}), title=target)
    assert env.spec.id == identity
    env.reset(seed=0)
    first = env.render()
    env.step(HOLD)
    assert np.any(env.render() != first)
