"""Events: the simulated camera by hand, recorded files, and the LGMD that events drive."""

import csv
import math

import numpy as np
import pytest

from lgmd_gym import neuron
from lgmd_gym.cli import main as cli
from lgmd_gym.neuron import LGMD, EventCamera, EventLGMD, EventParams, EventRecording
from lgmd_gym.paper.backgrounds import Screen
from lgmd_gym.paper.stimuli import Looming, stimulus_frames


def frame(*values):
    return np.array([[values]], np.uint8)


def log(light, dark=10.0):
    return math.log((light + dark) / (255.0 + dark))


def test_events_by_hand():
    """Each step against the memory, which is in multiples of the threshold from the first light."""
    camera = EventCamera((1, 3), 30.0, {"threshold": 0.25})
    assert camera.step(frame(100, 100, 100)).tolist() == [[[0, 0, 0]]]
    lights = (130, 60, 100)
    expected = [math.trunc((log(light) - log(100)) / 0.25) for light in lights]
    assert expected == [0, -1, 0]
    assert camera.step(frame(*lights)).tolist() == [[expected]]
    # From 130 on the memory is still that of 100: a further rise completes the step.
    after = [
        math.trunc((log(light) - log(100) - 0.25 * n) / 0.25)
        for light, n in zip((150, 60, 255), expected, strict=True)
    ]
    assert after == [1, 0, 3]
    assert camera.step(frame(150, 60, 255)).tolist() == [[after]]


def test_the_refractory_time_limits_the_events_and_the_rest_is_lost():
    camera = EventCamera((1, 1), 30.0, {"refractory_ms": 16.0})  # two in 33.3 ms
    camera.step(frame(0))
    assert camera.step(frame(255)).tolist() == [[[2]]]  # 16 crossings
    assert camera.step(frame(255)).tolist() == [[[0]]]
    assert EventCamera((1, 1), 30.0, {"refractory_ms": 50.0})._most == 1


def test_noise_is_that_of_the_rate_and_repeats_after_a_reset():
    camera = EventCamera((100, 100), 10.0, {"noise_hz": 5.0, "seed": 3}, num=2)
    still = np.full((2, 100, 100), 80, np.uint8)
    camera.step(still)
    first = camera.step(still)
    assert (first[0] == first[1]).all()  # each view has the noise of the seed
    later = [camera.step(still)[0] for _ in range(20)]
    # Signed sums of Poisson counts of mean 0.5 have mean 0 and variance 0.5.
    assert abs(np.mean(later)) < 0.01
    assert np.var(later) == pytest.approx(0.5, abs=0.02)
    camera.reset(np.array([True, False]))
    camera.step(still)
    assert (camera.step(still)[0] == first[0]).all()


def test_p_is_the_gain_times_the_events():
    model = EventLGMD((24, 32), 30.0, {"n_p": 0}, events={"gain": 15.0})
    rng = np.random.default_rng(0)
    counts = rng.integers(-3, 4, (24, 32))
    model.step_events(np.zeros((24, 32), int))  # the first interval has no predecessor
    model.step_events(counts)
    assert (model.layers["P"] == 15.0 * counts).all()
    model.step_events(np.full((24, 32), 100))
    assert model.layers["P"].max() == 127.0  # of a frame of rest and events, in 0 to 255
    with pytest.raises(ValueError, match=r"counts must have the shape \(24, 32\), got \(3, 3\)"):
        model.step_events(np.zeros((3, 3)))


def test_frames_and_their_events_give_the_same_outputs():
    frames = list(stimulus_frames(Screen(shape=(60, 80)), 1.4, None, Looming(contact=1.5)))
    camera, given = EventCamera((60, 80)), EventLGMD((60, 80))
    seen = neuron.make("events", (60, 80))
    peak = 0.0
    for picture in frames:
        response, counts = seen.step(picture), camera.step(picture[None])[0]
        assert given.step_events(counts) == response._asdict()
        peak = max(peak, response.spike_frequency)
    assert peak >= 30.0
    seen.reset()
    assert seen.step(frames[-1]).spike_frequency == 0.0


def test_log_intensity_makes_the_response_independent_of_the_light():
    """Halved luminance halves P of an LGMD, while the events stay, but for the dark level."""
    frames = list(stimulus_frames(Screen(shape=(60, 80)), 1.4, None, Looming(contact=1.5, luminance=60.0)))
    plain, events = LGMD((60, 80)), neuron.make("events:dark=0.001", (60, 80))
    dim, dim_events = LGMD((60, 80)), neuron.make("events:dark=0.001", (60, 80))
    for picture in frames:
        half = (picture.astype(np.float32)) / 2.0
        bright, same = events.step(picture.astype(np.float32)), dim_events.step(half)
        assert same.spike_frequency == bright.spike_frequency
        outputs = plain.step(picture), dim.step(half)
    assert outputs[1].ffi < 0.6 * outputs[0].ffi


def recording(path, **changes):
    arrays = {"x": [0, 2, 2, 1], "y": [0, 1, 1, 0], "t": [5.0, 5.01, 5.02, 5.11], "p": [1, 0, 0, 1]}
    np.savez(path, **{name: np.array(values) for name, values in (arrays | changes).items()})
    return path


def test_recorded_events_are_counted_by_interval(tmp_path):
    events = EventRecording.read(recording(tmp_path / "a.npz"))
    assert events.shape == (2, 3)
    assert [counts.tolist() for counts in events.counts(10.0)] == [
        [[1, 0, 0], [0, 0, -2]],
        [[0, 1, 0], [0, 0, 0]],
    ]
    given = EventRecording.read(recording(tmp_path / "b.npz", shape=[4, 5], p=[1, -1, -1, 1]))
    assert (given.shape, given.p.tolist()) == ((4, 5), [1, -1, -1, 1])
    assert sum(1 for _ in given.counts(1000.0)) == 111


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"t": [1.0, 0.5, 2.0, 3.0]}, "finite times that do not decrease"),
        ({"p": [1, 2, 1, 1]}, "polarities 0 and 1, or -1 and 1, got"),
        ({"p": [1, 0]}, "of one length > 0"),
        ({"x": [0, 0, 0, -1]}, "coordinates outside its sensor"),
        ({"shape": [1, 3]}, "coordinates outside its sensor of 3×1 px"),
    ],
)
def test_wrong_recordings_are_refused(changes, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        EventRecording.read(recording(tmp_path / "wrong.npz", **changes))


def test_a_file_that_is_no_recording_is_refused(tmp_path):
    (tmp_path / "text.npz").write_text("no")
    np.savez(tmp_path / "part.npz", x=[1], y=[1], t=[0.0])
    with pytest.raises(ValueError, match="cannot be read as"):
        EventRecording.read(tmp_path / "text.npz")
    with pytest.raises(ValueError, match="cannot be read as"):
        EventRecording.read(tmp_path / "none.npz")
    with pytest.raises(ValueError, match="lacks the array 'p'"):
        EventRecording.read(tmp_path / "part.npz")


def test_parameters_and_derotation():
    with pytest.raises(ValueError, match=r"events threshold must be in \(0, inf\), got 0"):
        EventParams(threshold=0.0)
    assert neuron.make("events:threshold=0.1,t_sp=0.78", (8, 8)).params.t_sp == 0.78
    model = neuron.make("events", (8, 8))
    with pytest.raises(ValueError, match="'events' has no derotation"):
        model.step(np.zeros((8, 8), np.uint8), turn_px=1)


def test_the_command_writes_the_trace(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    camera, found = EventCamera((60, 80)), []
    expected, model = [], EventLGMD((60, 80))
    for number, picture in enumerate(
        stimulus_frames(Screen(shape=(60, 80)), 1.4, None, Looming(contact=1.5))
    ):
        counts = camera.step(picture[None])[0]
        expected.append(model.step_events(counts)["spike_frequency"])
        for y, x in np.argwhere(counts).tolist():
            found += [(x, y, number / 30.0, int(counts[y, x] > 0))] * abs(int(counts[y, x]))
    start = found[0][2]
    x, y, t, p = map(np.array, zip(*found, strict=True))
    np.savez("square.npz", x=x, y=y, t=t, p=p, shape=[60, 80])
    assert cli.run(["neurons", "events", "square.npz", "--out", "trace.csv"]) == 0
    assert f"highest spike frequency {max(expected):g}/s" in capsys.readouterr().out
    with open("trace.csv") as file:
        rows = list(csv.DictReader(file))
    first = round(start * 30.0)
    frequencies = [float(row["spike_frequency"]) for row in rows]
    assert frequencies == expected[first : first + len(rows)]  # the recording starts at its first event
    assert sum(int(row["on"]) + int(row["off"]) for row in rows) == len(found)
    assert cli.run(["neurons", "events", "square.npz", "--neuron", "lgmd", "--out", "b.csv"]) == 2
    assert "--neuron must be events with options, got 'lgmd'" in capsys.readouterr().err
