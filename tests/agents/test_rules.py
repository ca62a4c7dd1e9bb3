"""Rules on synthetic neuron outputs: thresholds, frame counts, latch, yaw rate gate."""

import numpy as np
import pytest
from support.agents import frequency_reading, make_step, run_agent, to_potential

from lgmd_gym.agents import make_agent
from lgmd_gym.agents.filters import ConsecutiveFrames, YawRateGate
from lgmd_gym.agents.rule import SensorReading, excitation
from lgmd_gym.benchmark.sensors import SensorConfig


def test_excitation_inverts_equation_10():
    assert excitation(to_potential([0.0, 1.3, 6.0])) == pytest.approx([0.0, 1.3, 6.0], abs=1e-9)
    assert excitation(np.float32(1.0)) == pytest.approx(15.0, abs=0.1)


def test_consecutive_frames_restart_after_a_gap():
    counter = ConsecutiveFrames(2)
    assert [counter.update(bool(item)) for item in (1, 0, 1, 1, 1, 0)] == [0, 0, 0, 1, 1, 0]


def test_the_yaw_rate_gate_opens_after_its_number_of_frames():
    gate = YawRateGate(0.03, 2)
    assert [gate.update(rate) for rate in (0.0, -0.05, 0.0, 0.0, 0.03)] == [True, False, False, True, True]


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
        assert not agent.should_brake(frequency_reading(frequency)) or frequency < 30
    assert not agent.should_brake(frequency_reading(100.0))
    assert agent.should_brake(frequency_reading(250.0))
    assert make_agent(text).should_brake(frequency_reading(31.0))


def test_graded_predicts_the_frequency_and_releases_slowly():
    """A rise from 0 to 20 in 1/30 s with a lead of 0.1 s predicts 80; the demand is (80 - 30)/100."""
    agent = make_agent("graded:low=30,span=100,lead=0.1,fall=1")
    demands = run_agent(agent, *map(make_step, (20, 20, 0, 300)))
    assert demands == pytest.approx([-0.5, -0.5 + 1 / 30, -0.5 + 2 / 30, -1.0], abs=1e-6)
    released = run_agent(agent, *map(make_step, [0] * 30))
    assert released[-1] == pytest.approx(0.0, abs=1e-6)
    assert agent.latching is False


def test_the_threshold_of_speed_gated_rises_with_speed():
    text = "speed-gated:threshold=30,per_speed=2,frames=1"
    assert make_agent(text).should_brake(frequency_reading(46.0, speed=8.0))
    assert not make_agent(text).should_brake(frequency_reading(45.9, speed=8.0))
    assert not make_agent(text).should_brake(frequency_reading(46.0, speed=8.0, yaw_rate=0.2))


def test_nested_fields_choose_the_field_for_the_stopping_distance():
    """At 20 m/s: 20²/18 + 0.5 · 20 + 1.7 = 33.9 m; 2·atan(1.4/33.9) = 4.7°, covered by the 5° field."""
    agent = make_agent("nested-fields:frames=1")
    assert [agent.field_index(speed) for speed in (0.0, 10.0, 20.0)] == [5, 3, 0]
    for field, expected in ((0, True), (1, False)):
        excitations = np.zeros(6)
        excitations[field] = 2.0
        reading = SensorReading(np.zeros(6), to_potential(excitations), 20.0, 0.0)
        assert make_agent("nested-fields:frames=1").should_brake(reading) == expected


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
    assert make_agent("flow-divergence").measure(*frames) == pytest.approx(1.2, rel=0.15)


def test_the_cameras_of_an_agent_are_used_unless_the_user_names_others():
    agent = make_agent("stopping-zone")
    own = SensorConfig().for_agent(agent)
    assert own.camera == agent.camera
    assert own.label.startswith("ground0.28+ground0.4+")
    assert SensorConfig("tele").for_agent(agent).camera == "tele"
    assert SensorConfig().for_agent(make_agent("no-brake")).camera == "fovea"
    assert SensorConfig().for_agent(make_agent("frame-difference")).include_frame


def first_brake(agent, potential, speed, yaw_rate):
    """Return the index of the first reading at which the rule brakes, or None."""
    agent.reset(0)
    for index, values in enumerate(zip(potential, potential, speed, yaw_rate, strict=True)):
        if agent.should_brake(SensorReading(*values)):
            return index
    return None


@pytest.mark.parametrize("options", ["level=1.5,frames=6,settle=5", "level=1,frames=2,settle=1"])
def test_readings_of_cameras_that_are_not_in_use_have_no_effect(options):
    rng, agent = np.random.default_rng(7), make_agent(f"nested-fields:{options}")
    braked, unread = 0, []
    for _ in range(60):
        speed = np.clip(10 + np.cumsum(rng.normal(0.0, 0.6, 150)), 0.0, 28.0)
        yaw_rate = np.where(rng.uniform(size=150) < 0.02, 0.1, 0.0)
        # Levels that persist for some frames, mostly below the threshold.
        levels = np.repeat(rng.exponential(rng.uniform(0.3, 1.0), (15, 6)), 10, axis=0)
        potential, arbitrary = 1 / (1 + np.exp(-levels)), rng.uniform(0.5, 1.0, levels.shape)
        read = agent.cameras_in_use(speed, yaw_rate)
        expected = first_brake(agent, potential, speed, yaw_rate)
        assert first_brake(agent, np.where(read, potential, arbitrary), speed, yaw_rate) == expected
        braked += expected is not None
        unread.append(1.0 - read.mean())
    assert 10 < braked < 60
    assert np.mean(unread) > 0.4
