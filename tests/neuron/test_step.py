"""One neuron: outputs, frames, arguments, reset, region and copies."""

import copy
import pickle

import numpy as np
import pytest
from golden.sequences import looming, natural, random
from support.neurons import responses

from lgmd_gym.neuron import LGMD, LGMDParams, Response

SHAPE = (24, 37)


def test_first_frame_causes_no_change():
    assert LGMD(SHAPE).step(random(SHAPE, 1)[0]) == Response(0.0, 0, 0.5, 0.5, 0.0, 0.5, 10.0, False)
    released = LGMD(SHAPE, params=LGMDParams.released()).step(random(SHAPE, 1)[0])
    assert (released.membrane_potential, released.adapted_potential) == (0.0, 0.0)


def test_single_neuron_outputs_python_scalars():
    neuron = LGMD(SHAPE, 18.0)
    assert (neuron.shape, neuron.fps, neuron.params, neuron.num) == (SHAPE, 18.0, LGMDParams(), None)
    for frame in looming(SHAPE, 20):
        response = neuron.step(frame)
    assert [type(value) for value in response] == [float, int, float, float, float, float, float, bool]
    assert response.alert
    assert response.spike_frequency >= 30


def test_alert_is_spike_frequency_at_or_above_t_sf():
    expected = [response.spike_frequency for response in responses(looming(SHAPE, 30))]
    for level in (50.0, max(expected), max(expected) + 0.01):
        alerts = [response.alert for response in responses(looming(SHAPE, 30), params=LGMDParams(t_sf=level))]
        assert alerts == [frequency >= level for frequency in expected]


def test_frame_is_neither_stored_nor_changed():
    frames = natural(SHAPE, 6)
    buffer = np.empty(SHAPE, np.uint8)
    neuron, got = LGMD(SHAPE), []
    for frame in frames:
        buffer[:] = frame
        got.append(neuron.step(buffer))
        assert np.array_equal(buffer, frame)
        buffer[:] = 77
    assert got == responses(frames)


def test_memory_layout_of_a_frame_does_not_matter():
    frames = natural(SHAPE, 6)
    expected = responses(frames)
    wide = np.zeros((6, SHAPE[0], SHAPE[1] * 2), np.uint8)
    wide[:, :, ::2] = frames
    assert responses(wide[:, :, ::2]) == expected
    assert responses(np.asfortranarray(frames)) == expected
    assert responses(frames[:, ::-1][:, ::-1]) == expected
    frames.flags.writeable = False
    assert responses(frames) == expected
    assert [LGMD(SHAPE).step(frame.tolist()) for frame in frames[:1].astype(float)] == expected[:1]


FRAME = r"frame must have the shape \(24, 37\) \(height, width\), got "
RAMP = np.linspace(0, 1, 888).reshape(SHAPE)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (np.zeros((37, 24), np.uint8), FRAME + r"\(37, 24\); transpose it"),
        (np.zeros((24, 38), np.uint8), FRAME + r"\(24, 38\)$"),
        (np.zeros((24, 37, 3), np.uint8), FRAME + r"\(24, 37, 3\); convert colour to grey"),
        (np.zeros((0, 37), np.uint8), FRAME + r"\(0, 37\), which is empty"),
        (np.zeros(SHAPE, np.int64), r"must be uint8 or float, got int64; use frame.astype\(np.uint8\)"),
        (np.zeros(SHAPE, bool), "must be uint8 or float, got bool"),
        (np.full(SHAPE, np.nan), "must be finite, got 888 NaN or infinite pixels; use np.nan_to_num"),
        (np.where(np.arange(37) == 5, np.inf, RAMP), "must be finite, got 24 NaN or infinite pixels"),
        (RAMP, r"must be luminance in 0-255, got a float frame of 0 to 1; use frame \* 255"),
        (180 * RAMP - 90, "must be luminance in 0-255, got -90 to 90; use np.clip"),
    ],
)
def test_invalid_frame_raises_and_leaves_the_state_unchanged(frame, message):
    frames = looming(SHAPE, 12)
    neuron = LGMD(SHAPE)
    for valid in frames[:6]:
        neuron.step(valid)
    with pytest.raises((ValueError, TypeError), match=message) as error:
        neuron.step(frame)
    assert "\n" not in str(error.value)
    assert [neuron.step(valid) for valid in frames[6:]] == responses(frames)[6:]


def test_constant_float_frames_are_valid():
    for level in (0.0, 1.0, 0.5, 255.0):
        assert LGMD(SHAPE).step(np.full(SHAPE, level)).spikes == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": (0, 5)}, r"shape must be \(height, width\), each 1 to 16384 px, got \(0, 5\)"),
        ({"shape": 5}, r"shape must be \(height, width\), each 1 to 16384 px, got 5"),
        ({"shape": (5, 5, 3)}, r"shape must be \(height, width\), each 1 to 16384 px, got \(5, 5, 3\)"),
        ({"fps": 0}, "fps must be > 0 and finite, got 0"),
        ({"fps": -30}, "fps must be > 0 and finite, got -30"),
        ({"fps": float("nan")}, "fps must be finite, got nan"),
        ({"num": 0}, "num must be >= 1, got 0; pass None for a single neuron"),
        ({"num": 2.5}, "num must be an integer or None, got 2.5"),
        ({"threads": 0}, r"threads must be a whole number in \[1, 1024\], got 0"),
        ({"params": {"tsp": 0.7}}, "unknown LGMD field 'tsp'; did you mean 't_sp'?"),
        ({"params": 0.7}, "LGMD must be LGMDParams or Mapping, got 0.7"),
        ({"mask": np.zeros(SHAPE)}, "mask must have a weight > 0, got 0 everywhere"),
        ({"mask": np.ones((3, 3))}, r"mask must have the shape \(24, 37\) .*, got \(3, 3\)"),
        ({"mask": np.full(SHAPE, 1.5)}, r"mask must have weights in \[0, 1\], got 1.5 to 1.5"),
        ({"mask": np.full(SHAPE, np.nan)}, r"mask must have weights in \[0, 1\], got nan"),
        ({"mask": np.ones(SHAPE), "roi": (0, 0, 2, 2)}, "mask and roi must not both be given"),
        ({"roi": (20, 0, 10, 5)}, r"must be inside frames of shape \(24, 37\), got \(20, 0, 10, 5\)"),
    ],
)
def test_invalid_arguments_raise(options, message):
    with pytest.raises((ValueError, TypeError), match=message) as error:
        LGMD(**{"shape": SHAPE, **options})
    assert "\n" not in str(error.value)


def test_reset_neuron_equals_a_new_one():
    frames = looming(SHAPE, 20)
    for params in (LGMDParams(), LGMDParams.released()):
        neuron = LGMD(SHAPE, params=params)
        first = [neuron.step(frame) for frame in frames]
        neuron.reset()
        assert not any(image.any() for image in neuron.layers.values())
        assert [neuron.step(frame) for frame in frames] == first


def test_roi_equals_a_mask_of_ones():
    frames, mask = looming(SHAPE, 20), np.zeros(SHAPE)
    mask[3:20, 5:30] = 1
    assert responses(frames, mask=mask) == responses(frames, roi=(3, 5, 17, 25))
    neuron = LGMD(SHAPE, roi=(3, 5, 17, 25))
    for frame in frames:
        neuron.step(frame)
    assert neuron.layers["P"].shape == SHAPE
    assert not (neuron.layers["P"] * (1 - mask)).any()


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda neuron: pickle.loads(pickle.dumps(neuron))])
def test_copy_is_independent_of_the_original(clone):
    frames = looming(SHAPE, 20)
    neuron = LGMD(SHAPE, threads=2)
    for frame in frames[:10]:
        neuron.step(frame)
    other = clone(neuron)
    expected = [neuron.step(frame) for frame in frames[10:]]
    assert [other.step(frame) for frame in frames[10:]] == expected
