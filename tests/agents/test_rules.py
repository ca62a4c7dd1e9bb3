"""Rules on synthetic neuron outputs: thresholds, frame counts, latch, yaw rate gate."""

import numpy as np
import pytest
from support.agents import (
    any_brake,
    frequency_reading,
    make_step,
    reading,
    run_agent,
    should_brake,
    to_potential,
)

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.rules import excitation
from lgmd_gym.benchmark.sensors import SensorConfig


def test_excitation_inverts_equation_10():
    assert excitation(to_potential([0.0, 1.3, 6.0])) == pytest.approx([0.0, 1.3, 6.0], abs=1e-9)
    assert excitation(np.float32(1.0)) == pytest.approx(15.0, abs=0.1)


def test_direction_selective_potentials_have_negative_excitations():
    assert excitation(to_potential([-2.0])) == pytest.approx([-2.0])


def test_spike_threshold_latches_until_reset():
    agent = make_agent("spike-threshold:threshold=30")
    assert run_agent(agent, *map(make_step, (0, 29.9, 30, 0, 0))) == [0, 0, -1, -1, -1]
    agent.reset(0)
    assert run_agent(agent, make_step(0.0)) == [0]


def test_spike_threshold_requires_consecutive_frames():
    agent = make_agent("spike-threshold:frames=3")
    assert run_agent(agent, *map(make_step, (40, 40, 0, 40, 40, 40))) == [0, 0, 0, 0, 0, -1]


def test_every_frame_of_a_trace_counts():
    agent = make_agent("spike-threshold:frames=2")
    assert run_agent(agent, make_step(40, 0, 40, trace=True)) == [0]
    assert run_agent(agent, make_step(40, 0, trace=True)) == [-1]


def test_adaptive_threshold_follows_the_mean_frequency():
    text = "adaptive-threshold:threshold=30,gain=3,memory=10,frames=1"
    agent = make_agent(text)
    for frequency in np.linspace(0.0, 60.0, 120):  # slower than the low-pass
        assert not should_brake(agent, frequency_reading(frequency)) or frequency < 30
    assert not should_brake(agent, frequency_reading(100.0))
    assert should_brake(agent, frequency_reading(250.0))
    assert should_brake(make_agent(text), frequency_reading(31.0))


def field_reading(excitation, yaw_rate=0.0):
    return reading(0.0, to_potential([excitation]), 13.0, yaw_rate)


def test_danger_zone_brakes_at_its_level_in_consecutive_frames():
    agent = make_agent("danger-zone:level=4,frames=2")
    levels = (4.0, 3.99, 4.0, 4.0)
    assert [should_brake(agent, field_reading(x)) for x in levels] == [False, False, False, True]
    assert not any_brake(make_agent("danger-zone:level=4,frames=2"), [field_reading(3.99)] * 9)


def test_danger_zone_is_inactive_in_turns_and_for_some_frames_after_them():
    agent = make_agent("danger-zone:level=4,frames=1,yaw_rate=0.03,settle=2")
    rates = (0.03, -0.031, 0.0, 0.0, 0.03)
    brakes = [should_brake(agent, field_reading(5.0, rate)) for rate in rates]
    assert brakes == [True, False, False, True, True]


def frame_steps(*greys):
    for grey in greys:
        observation, info = make_step(0.0)
        yield observation | {"frame": np.full((90, 160, 1), grey, np.uint8)}, info


def test_frame_difference_brakes_at_the_mean_absolute_difference():
    text = "frame-difference:level=3,frames=2"
    assert run_agent(make_agent(text), *frame_steps(10, 13, 10)) == [0, 0, -1]
    assert run_agent(make_agent(text), *frame_steps(10, 12, 10, 12)) == [0, 0, 0, 0]
    assert run_agent(make_agent(text), *frame_steps(10, 13, 13, 10)) == [0, 0, 0, 0]


def test_flow_divergence_is_twice_the_rate_of_expansion():
    """A texture that expands by 2 % per frame has the divergence 2 · 0.02 · 30 Hz = 1.2 1/s."""
    cv2 = pytest.importorskip("cv2")
    texture = cv2.GaussianBlur(np.random.default_rng(0).normal(size=(400, 600)), (0, 0), 2)
    texture = (128 + 40 * texture / texture.std()).clip(0, 255).astype(np.uint8)
    expanded = cv2.warpAffine(texture, cv2.getRotationMatrix2D((299.5, 199.5), 0.0, 1.02), (600, 400))
    frames = [np.ascontiguousarray(image[155:245, 220:380]) for image in (texture, expanded)]
    assert make_agent("flow-divergence").agent.measure(*frames) == pytest.approx(1.2, rel=0.15)


def test_the_cameras_of_an_agent_are_used_unless_the_user_names_others():
    agent = make_agent("stopping-zone")
    own = SensorConfig().for_agent(agent)
    assert own.camera == agent.camera
    assert own.label.startswith("ground0.28+ground0.4+")
    assert SensorConfig("tele").for_agent(agent).camera == "tele"
    assert SensorConfig().for_agent(make_agent("no-brake")).camera == "fovea"
    assert SensorConfig().for_agent(make_agent("frame-difference")).include_frame
