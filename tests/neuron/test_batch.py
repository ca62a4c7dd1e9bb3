"""Batches of neurons: equality with single neurons, selections and threads."""

import numpy as np
import pytest
from golden.sequences import KINDS

from lgmd_gym.neuron import LGMD, LGMDParams, Response

SHAPE = (24, 37)


def batch(num, count=12):
    """Return frames for `num` neurons, uint8, (count, num, H, W)."""
    kinds = list(KINDS.values())
    return np.stack([kinds[i % 4](SHAPE, count) for i in range(num)], axis=1)


@pytest.mark.parametrize("threads", [None, 2, 3, 8])
@pytest.mark.parametrize("params", [LGMDParams(), LGMDParams.released()])
def test_batch_equals_single_neurons(threads, params):
    neurons = LGMD(SHAPE, params=params, num=5, threads=threads)
    singles = [LGMD(SHAPE, params=params) for _ in range(5)]
    for stack in batch(5):
        response = neurons.step(stack)
        for i, (neuron, frame) in enumerate(zip(singles, stack, strict=True)):
            assert Response(*(field[i] for field in response)) == neuron.step(frame)
    for name, images in neurons.layers.items():
        assert np.array_equal(images, [neuron.layers[name] for neuron in singles])


def test_batch_returns_new_arrays():
    frames = batch(4)
    neurons = LGMD(SHAPE, num=4)
    returned = [neurons.step(stack) for stack in frames]
    layers = neurons.layers
    copies = [[field.copy() for field in response] for response in returned]
    layer_copies = {name: image.copy() for name, image in layers.items()}
    for stack in frames:
        for field in neurons.step(stack):
            field[:] = 0
    np.testing.assert_equal([list(response) for response in returned], copies)
    np.testing.assert_equal(layers, layer_copies)
    assert [field.dtype.name for field in returned[0]] == ["float64", "int64", *["float64"] * 5, "bool"]


def test_batch_of_one_returns_arrays():
    assert LGMD(SHAPE, num=1).step(np.zeros((1, *SHAPE), np.uint8)).spikes.shape == (1,)
    with pytest.raises(ValueError, match=r"shape \(1, 24, 37\) \(num, height, width\), got \(24, 37\)"):
        LGMD(SHAPE, num=1).step(np.zeros(SHAPE, np.uint8))


def test_partial_reset_leaves_the_other_neurons_unchanged():
    frames, mask = batch(4, 16), np.array([True, False, True, False])
    neurons, never_reset = LGMD(SHAPE, num=4), LGMD(SHAPE, num=4)
    for stack in frames[:8]:
        neurons.step(stack)
        never_reset.step(stack)
    neurons.reset(mask)
    new = LGMD(SHAPE, num=4)
    for stack in frames[8:]:
        fields = zip(neurons.step(stack), new.step(stack), never_reset.step(stack), strict=True)
        for got, of_new, of_never_reset in fields:
            assert np.array_equal(got, np.where(mask, of_new, of_never_reset))


def test_inactive_neurons_keep_state_and_outputs():
    frames, active = batch(4), np.array([True, True, False, False])
    neurons, singles = LGMD(SHAPE, num=4), [LGMD(SHAPE) for _ in range(4)]
    expected = [singles[i].step(frames[0][i]) for i in range(4)]
    neurons.step(frames[0])
    for number, stack in enumerate(frames[1:]):
        selected = np.roll(active, number)
        stack = np.where(selected[:, None, None], stack.astype(float), np.nan)
        response = neurons.step(stack, active=selected)
        expected = [singles[i].step(stack[i]) if selected[i] else expected[i] for i in range(4)]
        assert [Response(*(field[i] for field in response)) for i in range(4)] == expected


@pytest.mark.parametrize("selection", [[1, 0, 1, 0], [True, False], np.ones((4, 1), bool), True])
def test_invalid_selection_raises(selection):
    neurons = LGMD(SHAPE, num=4)
    with pytest.raises(ValueError, match=r"mask must be a bool array of shape \(4,\), got dtype"):
        neurons.reset(selection)
    with pytest.raises(ValueError, match=r"active must be a bool array of shape \(4,\), got dtype"):
        neurons.step(np.zeros((4, *SHAPE), np.uint8), active=selection)
