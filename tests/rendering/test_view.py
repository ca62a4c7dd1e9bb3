"""The composed picture: it shows what was seen, changes nothing, and can be told apart by everybody."""

import os
import subprocess
import sys
from itertools import combinations

import gymnasium as gym
import highway_env  # noqa: F401  (registers highway-v0)
import numpy as np
import pytest

from lgmd_gym import CameraParams, EgoCamera, LGMDObservation, LGMDView
from lgmd_gym.agents import make_agent
from lgmd_gym.cli import main as cli
from lgmd_gym.neuron.danger_zone import danger_zone
from lgmd_gym.rendering import canvas as colours
from lgmd_gym.rendering.overlays import danger_lines, target_boxes
from lgmd_gym.rendering.panels import CAMERA_COLOURS, EYE, TOP
from lgmd_gym.rendering.playback import drive, make_target
from lgmd_gym.rendering.state import Moment
from lgmd_gym.rendering.trace_panel import PLOT, Trace
from lgmd_gym.rendering.window import Window

HOLD, BRAKE = [0.0], [-1.0]


def approach(**arguments):
    return gym.make("LGMD/CCRs-v0", **{"ego_speed": 8.0, "shade": 60, **arguments})


def play(env, action=HOLD, seed=0):
    _, info = env.reset(seed=seed)
    done = False
    while not done:
        *_, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    return info


def test_the_eye_panel_holds_the_frame():
    env = LGMDView(approach(), overlays=())
    env.reset(seed=0)
    for _ in range(20):
        env.step(HOLD)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((720, 1280, 3), np.uint8)
    eye = picture[EYE[1] : EYE[3], EYE[0] : EYE[2]]
    frame = env.get_wrapper_attr("frames")["fovea"]
    assert (eye[2::5, 2::5] == frame[:, :, None]).all()
    top = picture[TOP[1] : TOP[3], TOP[0] : TOP[2]]
    assert (top == (50, 200, 0)).all(axis=-1).any()  # the ego's colour in highway-env
    assert env.render() is not picture


def test_it_changes_nothing():
    with_view, bare = LGMDView(approach(), "rgb_array"), approach()
    assert str(with_view.reset(seed=3)) == str(bare.reset(seed=3))
    for _ in range(60):
        with_view.render()
        assert str(with_view.step(BRAKE)) == str(bare.step(BRAKE))
    assert bare.observation_space == with_view.observation_space


def test_trace_is_passed_on_only_to_who_asked():
    for asked in (False, True):
        env = LGMDView(approach(trace=asked))
        _, info = env.reset(seed=0)
        assert ("lgmd/trace" in info) == asked
        assert ("lgmd/trace" in env.step(HOLD)[4]) == asked


def lamp(picture, x):
    return tuple(picture[16, x])


def test_lamps_and_bars_tell_the_outcome():
    env = LGMDView(approach())
    play(env)
    hit = env.render()
    assert lamp(hit, 1070) == colours.PINK
    assert lamp(hit, 920) == colours.UNLIT
    play(env, BRAKE)
    stopped = env.render()
    assert lamp(stopped, 1070) == colours.UNLIT
    env.agent_alert = True
    assert lamp(env.render(), 780) == colours.YELLOW
    env.agent_alert = False
    assert lamp(env.render(), 780) == colours.UNLIT


def test_the_threshold_line_is_at_its_level():
    trace = Trace(30.0, ["fovea"], [colours.SKY])
    canvas = colours.Canvas((1280, 720))
    trace.add(0.0, [30.0], 1)
    trace.add(1.0, [30.0], 1)
    trace.draw(canvas, 0.5)
    column = canvas.pixels[:, PLOT[2] - 5]
    (rows,) = np.nonzero((column == colours.YELLOW).all(axis=1))
    share = (PLOT[3] - rows.mean()) / (PLOT[3] - PLOT[1])
    assert share == pytest.approx(30.0 / 120.0, abs=0.02)
    # The frequency at the level lies on the line; the first fifth of the plot is the first second.
    x = PLOT[0] + (PLOT[2] - PLOT[0]) // 10
    (blue,) = np.nonzero((canvas.pixels[:, x] == colours.SKY).all(axis=1))
    assert abs(blue.mean() - rows.mean()) <= 2.0


def test_danger_lines_are_the_edges_of_the_danger_zone():
    env = approach(camera=None)
    env.reset(seed=0)
    camera = EgoCamera("standard", mount_setback=0.0)
    camera.render(env)
    mask = danger_zone(camera.shape, camera.params.hfov_deg, height_m=camera.params.mount_height)
    left, right = danger_lines(camera, env.unwrapped.vehicle)
    for row in (60, 75, 88):
        inside = np.flatnonzero(mask[row] > 0.5)
        u = [np.interp(row + 0.5, edge[::-1, 1][::1], edge[::-1, 0]) for edge in (left, right)]
        assert u == pytest.approx([inside[0], inside[-1] + 1], abs=1.5)


def test_target_box_encloses_the_target():
    env = approach(camera=None)
    env.reset(seed=0)
    camera = EgoCamera(CameraParams.preset("fovea", vehicles="box", mount_setback=0.0))
    camera.render(env)
    ((left, top, right, bottom),) = target_boxes(camera, env.unwrapped)
    gap = 5.0 * 8.0  # s before contact × m/s
    assert right - left == pytest.approx(camera.params.focal_px * 1.712 / gap, rel=1e-6)
    assert bottom - top == pytest.approx(camera.params.focal_px * 1.427 / gap, rel=0.12)  # and its far end
    assert (left + right) / 2 == pytest.approx(80.0, abs=1e-6)


def test_record_video_records_it(tmp_path):
    from imageio_ffmpeg import count_frames_and_secs

    env = gym.wrappers.RecordVideo(LGMDView(approach(ego_speed=4.0)), str(tmp_path), disable_logger=True)
    env.reset(seed=0)
    steps, done = 0, False
    while not done:
        *_, terminated, truncated, _ = env.step(BRAKE)
        done, steps = terminated or truncated, steps + 1
    env.close()
    (video,) = tmp_path.glob("*.mp4")
    frames, seconds = count_frames_and_secs(str(video))
    assert frames == steps + 1
    assert seconds == pytest.approx(frames / 30.0, rel=0.1)


def test_a_slow_policy_still_shows_every_camera_frame():
    host = gym.make(
        "highway-v0", config={"simulation_frequency": 30, "policy_frequency": 5, "vehicles_count": 3}
    )
    env = LGMDView(LGMDObservation(host, camera=["fovea", "wide"]), camera="wide")
    env.reset(seed=0)
    for _ in range(3):
        env.step(1)
    assert len(env._picture._trace._seen) == 1 + 3 * 6
    picture = env.render()  # without gap and time to contact, which highway-v0 does not tell
    assert picture.std() > 20
    assert env.metadata["render_fps"] == 5


def test_undefined_values_stay_undefined():
    env = approach(camera=None)
    env.reset(seed=0)
    moment = Moment.of(env.unwrapped, {})
    assert np.isinf([moment.gap, moment.ttc, moment.impact_speed]).all()
    assert moment.speed == 8.0
    assert not moment.contact


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"render_mode": "ansi"}, "unknown render mode 'ansi'"),
        ({"overlays": ("zon",)}, "did you mean 'zone'?"),
        ({"camera": "wide"}, "unknown camera 'wide'"),
    ],
)
def test_refusals(arguments, words):
    with pytest.raises(ValueError, match=words.replace("?", r"\?")):
        LGMDView(approach(), **arguments)


def test_needs_an_eye_and_a_reset():
    with pytest.raises(ValueError, match="no LGMDObservation"):
        LGMDView(approach(camera=None))
    with pytest.raises(RuntimeError, match="call reset first"):
        LGMDView(approach()).render()


WINDOW = """
import gymnasium as gym, numpy as np, pygame, lgmd_gym
env = lgmd_gym.LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=8.0), render_mode="human")
env.reset(seed=0)
for _ in range(3):
    env.step([0.0])
shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
assert pygame.display.get_caption()[0] == "LGMD/CCRs-v0"
still = lgmd_gym.LGMDView(gym.make("LGMD/CCRs-v0", ego_speed=8.0), title="LGMD/CCRs-v0")
still.reset(seed=0)
for _ in range(3):
    still.step([0.0])
assert (shown == still.render()).all()
pygame.event.post(pygame.event.Event(pygame.QUIT))
env.step([0.0])
assert not env.window.open
env.step([0.0])
env.close()
"""


def in_surroundings(code, **surroundings):
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, env={**kept, **surroundings}
    )


def test_window_shows_the_picture():
    done = in_surroundings(WINDOW, SDL_VIDEODRIVER="dummy")
    assert done.returncode == 0, done.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there is always a display")
def test_no_display_is_said_in_one_line(monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    assert cli.run(["drive", "LGMD/CCRs-v0", "--live"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "neither DISPLAY nor WAYLAND_DISPLAY is set; write a file with --video" in said


# Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
BLINDNESS = {
    "protan": (
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ),
    "deutan": (
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ),
    "tritan": (
        (1.255528, -0.076749, -0.178779),
        (-0.078411, 0.930809, 0.147602),
        (0.004733, 0.691367, 0.303900),
    ),
}


def lab(rgb, matrix):
    linear = ((np.asarray(rgb) / 255.0 + 0.055) / 1.055) ** 2.4
    linear = np.clip(np.asarray(matrix) @ linear, 0.0, 1.0)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    f = np.cbrt(np.maximum(np.array(to_xyz) @ linear / (0.9505, 1.0, 1.089), 1e-9))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("kind", BLINDNESS)
def test_colours_can_be_told_apart(kind):
    """Traces of cameras, and lamps, which besides carry their words: CIE76 differences."""
    lamps = (colours.YELLOW, colours.RED, colours.PINK, colours.UNLIT)
    for group, least in ((CAMERA_COLOURS, 20.0), (lamps, 20.0)):
        for one, other in combinations(group, 2):
            apart = np.linalg.norm(lab(one, BLINDNESS[kind]) - lab(other, BLINDNESS[kind]))
            assert apart > least, f"{one} and {other} are {apart:.0f} apart"


def test_closing_the_window_ends_a_drive(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    shown = []

    def show(window, picture):
        shown.append(picture.shape)
        return len(shown) < 5

    monkeypatch.setattr(Window, "show", show)
    end = drive("LGMD/CCRs-v0", make_agent("no-brake"), 0, {}, live=True)
    assert end.stopped
    assert end.duration == pytest.approx(4 / 30)
    assert shown == [(720, 1280, 3)] * 5


@pytest.mark.parametrize(
    ("target", "arguments", "words"),
    [
        ("traffic/merg", {}, "did you mean 'traffic/merge'"),
        ("traffic/merge", {"ego_speed": 5.0}, "takes no scenario arguments, got ego_speed"),
    ],
)
def test_targets_are_refused_with_the_nearest(target, arguments, words):
    with pytest.raises(ValueError, match=words):
        make_target(target, arguments)


@pytest.mark.parametrize("target", ["traffic/merge", "LGMD/RandomBraking-v0", "quick/CCRs/v30"])
def test_every_kind_of_target_can_be_looked_at(target):
    env = LGMDView(make_target(target, {}), title=target)
    env.reset(seed=0)
    env.step(HOLD)
    assert env.render().std() > 20


def test_of_many_cameras_the_busiest_are_shown():
    env = LGMDView(approach(camera=[{"name": f"c{k}", "hfov_deg": 3.0 + 4.0 * k} for k in range(6)]))
    env.reset(seed=0)
    for _ in range(140):
        env.step(HOLD)
    picture = env.render()
    assert picture.shape == (720, 1280, 3)
    ranked = env._picture._ranked()
    frequencies = env.get_wrapper_attr("response").spike_frequency
    assert len(ranked) == 4
    assert frequencies[ranked[0]] == frequencies.max() > 0.0
    env.close()
