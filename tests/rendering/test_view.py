"""`LGMDView` and its dashboard: panels, lamps, trace, recording and arguments."""

import gymnasium as gym
import highway_env  # noqa: F401  (registers highway-v0)
import numpy as np
import pytest
from support.rollouts import BRAKE, HOLD

from lgmd_gym import LGMDObservation, LGMDView
from lgmd_gym.rendering import canvas
from lgmd_gym.rendering.dashboard import (
    CAMERA_COLOURS,
    CAMERA_FRAME,
    LAYER_BOXES,
    PLOT,
    TOP_VIEW,
    SpikeTracePanel,
)
from lgmd_gym.rendering.display import DisplayState

EGO_COLOUR = (50, 200, 0)  # in highway-env's top view


def approach(**arguments):
    return gym.make("LGMD/CCRs-v0", **{"ego_speed": 8.0, "shade": 60, **arguments})


def play(env, action):
    """Run an episode with a constant action; return the number of steps."""
    env.reset(seed=0)
    steps, done = 0, False
    while not done:
        *_, terminated, truncated, _ = env.step(action)
        done, steps = terminated or truncated, steps + 1
    return steps


def test_picture_contains_the_camera_frame_and_the_ego_in_the_top_view():
    env = LGMDView(approach(), overlays=())
    env.reset(seed=0)
    for _ in range(20):
        env.step(HOLD)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((720, 1280, 3), np.uint8)
    left, top, right, bottom = CAMERA_FRAME
    frame = env.get_wrapper_attr("frames")["fovea"]
    enlarged = frame.repeat(5, axis=0).repeat(5, axis=1)
    np.testing.assert_array_equal(picture[top:bottom, left:right], enlarged[:, :, None].repeat(3, axis=2))
    left, top, right, bottom = TOP_VIEW
    assert (picture[top:bottom, left:right] == EGO_COLOUR).all(
        axis=-1
    ).sum() > 50  # 4.3 m x 1.8 m at 5.5 px/m
    assert env.render() is not picture


def test_view_does_not_change_the_episode():
    view, env = LGMDView(approach()), approach()
    assert view.observation_space == env.observation_space
    np.testing.assert_equal(view.reset(seed=3), env.reset(seed=3))
    for _ in range(60):
        view.render()
        np.testing.assert_equal(view.step(BRAKE), env.step(BRAKE))


@pytest.mark.parametrize("trace", [False, True])
def test_info_contains_the_trace_only_if_requested(trace):
    env = LGMDView(approach(trace=trace))
    _, info = env.reset(seed=0)
    assert ("lgmd/trace" in info) == trace
    assert ("lgmd/trace" in env.step(HOLD)[4]) == trace


def lamp_colour(picture, x):
    return tuple(picture[16, x])


def test_lamps_show_contact_braking_and_alert():
    alert_x, braking_x, contact_x = 780, 920, 1070
    env = LGMDView(approach())
    play(env, HOLD)
    picture = env.render()
    assert lamp_colour(picture, contact_x) == canvas.PINK
    assert lamp_colour(picture, braking_x) == canvas.UNLIT
    env.reset(seed=0)
    for _ in range(15):
        env.step(BRAKE)
    picture = env.render()
    assert lamp_colour(picture, contact_x) == canvas.UNLIT
    assert lamp_colour(picture, braking_x) == canvas.RED
    for alert, colour in ((True, canvas.YELLOW), (False, canvas.UNLIT)):
        env.agent_alert = alert
        assert lamp_colour(env.render(), alert_x) == colour


def test_alert_level_is_drawn_at_its_frequency():
    panel, drawing = SpikeTracePanel(30.0, ["fovea"], [canvas.SKY]), canvas.Canvas((1280, 720))
    panel.add(0.0, [30.0], 1)
    panel.add(1.0, [30.0], 1)
    panel.draw(drawing, 0.5)
    left, top, right, bottom = PLOT
    (level_rows,) = np.nonzero((drawing.pixels[:, right - 5] == canvas.YELLOW).all(axis=1))
    assert (bottom - level_rows.mean()) / (bottom - top) == pytest.approx(30.0 / 120.0, abs=0.02)
    # The trace of 0 to 1 s, at the alert level, is in the first fifth of the plot.
    (trace_rows,) = np.nonzero((drawing.pixels[:, left + (right - left) // 10] == canvas.SKY).all(axis=1))
    assert abs(trace_rows.mean() - level_rows.mean()) <= 2.0


def test_trace_contains_every_camera_frame_of_slow_decisions():
    config = {"simulation_frequency": 30, "policy_frequency": 5, "vehicles_count": 3}
    env = LGMDObservation(gym.make("highway-v0", config=config), camera=["fovea", "wide"])
    env = LGMDView(env, camera="wide")
    env.reset(seed=0)
    for _ in range(3):
        env.step(1)
    assert len(env._dashboard._trace_panel) == 1 + 3 * 6
    assert env.metadata["render_fps"] == 5
    assert env._dashboard.ranked_cameras() == [1, 0]
    left, top = CAMERA_FRAME[:2]
    corner = env.render()[top : top + 100, left : left + 100]  # without overlays and insets
    np.testing.assert_array_equal(corner[2::5, 2::5, 0], env.get_wrapper_attr("frames")["wide"][:20, :20])


def test_more_than_four_cameras_are_ranked_by_spike_frequency():
    cameras = [{"name": f"c{k}", "hfov_deg": 3.0 + 4.0 * k} for k in range(6)]
    env = LGMDView(approach(camera=cameras))
    env.reset(seed=0)
    for _ in range(140):
        env.step(HOLD)
    frequencies = env.get_wrapper_attr("response").spike_frequency
    ranked = env._dashboard.ranked_cameras()
    assert frequencies.max() > 0.0
    assert len(ranked) == len(CAMERA_COLOURS)
    assert frequencies[ranked].tolist() == sorted(frequencies, reverse=True)[:4]
    assert env.render().shape == (720, 1280, 3)


def test_quantities_missing_from_the_info_stay_undefined():
    env = approach(camera=None)
    env.reset(seed=0)
    state = DisplayState.from_info(env.unwrapped, {})
    assert np.isinf([state.gap, state.ttc, state.impact_speed]).all()
    assert state.speed == 8.0
    assert not state.contact


@pytest.mark.usefixtures("moviepy")
def test_record_video_writes_every_picture(tmp_path):
    from imageio_ffmpeg import count_frames_and_secs

    env = gym.wrappers.RecordVideo(LGMDView(approach(ego_speed=4.0)), str(tmp_path), disable_logger=True)
    steps = play(env, BRAKE)
    env.close()
    (video,) = tmp_path.glob("*.mp4")
    frames, seconds = count_frames_and_secs(str(video))
    assert frames == steps + 1
    assert seconds == pytest.approx(frames / 30.0, rel=0.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"render_mode": "ansi"}, "unknown render mode 'ansi'"),
        ({"overlays": ("zon",)}, r"unknown overlay 'zon'; did you mean 'zone'\?"),
        ({"camera": "wide"}, "unknown camera 'wide'"),
    ],
)
def test_invalid_arguments_raise(arguments, message):
    with pytest.raises(ValueError, match=message):
        LGMDView(approach(), **arguments)


def test_unsupported_environments_raise():
    with pytest.raises(ValueError, match="env must have an LGMDObservation among its wrappers"):
        LGMDView(approach(camera=None))
    with pytest.raises(ValueError, match="env must not have render_mode 'human'"):
        LGMDView(approach(render_mode="human"))


def test_render_before_reset_raises():
    with pytest.raises(RuntimeError, match="reset must be called before render"):
        LGMDView(approach()).render()


@pytest.mark.parametrize("neuron", ["lplc2", "dsn"])
def test_layers_are_those_of_the_neuron(neuron):
    pictures = []
    for name in (neuron, "lgmd"):
        env = LGMDView(approach(camera={"mount": {"yaw_deg": 10.0}}, neuron=name))
        env.reset(seed=0)
        for _ in range(10):
            env.step(HOLD)
        pictures.append(env.render())
        env.close()
    (left, top, right, bottom), *_ = LAYER_BOXES
    first, second = (picture[top:bottom, left:right] for picture in pictures)
    assert len(np.unique(first)) > 10
    assert not np.array_equal(first, second)
    left, top, right, bottom = LAYER_BOXES[3]  # only the LGMD has four layers
    assert len(np.unique(pictures[0][top:bottom, left:right])) < len(
        np.unique(pictures[1][top:bottom, left:right])
    )
