"""Shifted state: a neuron in a turning view equals one that sees the whole panorama at once."""

from functools import partial

import numpy as np
import pytest

from lgmd_gym import LGMD
from lgmd_gym.neuron import DSN, LPLC2, SustainedEdges

HEIGHT, WIDTH, PANORAMA, FRAMES = 20, 61, 160, 14
# Model and the maps that depend on the pixels and their neighbours only.
MODELS = {
    "LGMD": (LGMD, ("P", "E", "I")),
    "LGMD with the delay of two frames": (partial(LGMD, params={"delay": "two-tap"}), ("P", "E", "I")),
    "DSN": (DSN, ("right",)),
    "LPLC2": (LPLC2, ("right", "down")),
    "SustainedEdges": (SustainedEdges, ("light", "edges")),
}


def panoramas():
    """Return frames of a textured panorama with a bar that moves to the right and grows."""
    rng = np.random.default_rng(3)
    background = rng.integers(60, 160, (HEIGHT, PANORAMA)).astype(np.uint8)
    for time in range(FRAMES):
        frame = background.copy()
        frame[4:16, 50 + 2 * time : 60 + 3 * time] = 230
        yield frame


def offsets(step):
    """Return the left edge of the view in each frame; it turns by `step` and one pixel in turn."""
    first = 10 if step > 0 else 60
    return first + np.cumsum([0] + [step if time % 2 else int(np.sign(step)) for time in range(FRAMES - 1)])


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("step", [3, -3])
def test_maps_of_a_turning_view_equal_those_of_the_panorama(name, step):
    model, maps = MODELS[name]
    whole, turning = model((HEIGHT, PANORAMA)), model((HEIGHT, WIDTH))
    lefts = offsets(step)
    for time, (frame, left) in enumerate(zip(panoramas(), lefts, strict=True)):
        whole.step(frame)
        turning.step(frame[:, left : left + WIDTH], turn_px=left - lefts[max(time - 1, 0)])
        # Columns that have always been in the view, without the two next to its edges.
        first, last = max(lefts[: time + 1]) + 2, min(lefts[: time + 1]) + WIDTH - 2
        for name in maps:
            expected = whole.layers[name][:, first:last]
            found = turning.layers[name][:, first - left : last - left]
            # Whole vectors of pixels and the pixels after them differ in the last bit.
            np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-5, err_msg=f"{name}, {time}")
    assert last - first > 5
    assert expected.any()


@pytest.mark.parametrize("name", MODELS)
def test_a_turn_in_front_of_a_still_panorama_causes_no_response(name):
    model, _ = MODELS[name]
    panorama = next(panoramas())
    steady, turning, moving = (model((HEIGHT, WIDTH)) for _ in range(3))
    for time in range(FRAMES):
        left = 4 * time
        steady.step(panorama[:, :WIDTH])
        response = turning.step(panorama[:, left : left + WIDTH], turn_px=4 if time else 0)
        moved = moving.step(panorama[:, left : left + WIDTH])
    if name == "SustainedEdges":
        edges = np.abs(np.diff(panorama[:, left : left + WIDTH].astype(float), axis=1)).sum()
        assert response.ffi == pytest.approx(edges / (HEIGHT * WIDTH), rel=1e-4)
        assert response.ffi > 1.5 * moved.ffi
    else:
        assert response.ffi == 0.0
        assert moved.ffi > 1.0


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("turn_px", [WIDTH, -WIDTH, 10**12])
def test_a_turn_beyond_the_frame_is_a_new_start(name, turn_px):
    model, _ = MODELS[name]
    frames = list(panoramas())
    neuron, fresh = model((HEIGHT, WIDTH)), model((HEIGHT, WIDTH))
    for frame in frames[:6]:
        neuron.step(frame[:, 50 : 50 + WIDTH])
    neuron.step(frames[6][:, :WIDTH], turn_px=turn_px)
    fresh.step(frames[6][:, :WIDTH])
    for name, values in neuron.layers.items():
        if name in ("P", "right", "down", "light"):
            np.testing.assert_array_equal(values, fresh.layers[name] if name != "P" else 0.0)
    if name == "light":
        np.testing.assert_array_equal(values, frames[6][:, :WIDTH])


@pytest.mark.parametrize("name", MODELS)
def test_neurons_turn_by_their_own_pixels_and_others_keep_their_state(name):
    model, _ = MODELS[name]
    frames = np.stack([frame[:, 40 : 40 + WIDTH] for frame in panoramas()])
    several, singles = model((HEIGHT, WIDTH), num=3), [model((HEIGHT, WIDTH)) for _ in range(3)]
    active = np.array([True, False, True])
    for time, frame in enumerate(frames):
        turns = np.array([0, 5, -2]) if time > 3 else np.zeros(3, np.int64)
        several.step(np.stack([frame] * 3), active if time > 5 else None, turn_px=turns)
        for index, single in enumerate(singles):
            if time <= 5 or active[index]:
                single.step(frame, turn_px=int(turns[index]))
    expected = [single.outputs[0] for single in singles]
    np.testing.assert_array_equal(several.outputs, expected)


def test_columns_follow_the_content():
    """G is filtered over time; its memory moves with the object."""
    neurons = LGMD((HEIGHT, 48)), LGMD((HEIGHT, 48))
    frames = list(panoramas())
    for time, frame in enumerate(frames):
        steady = frame[:, 40:88]
        turned = frame[:, 40 + 16 * (time == FRAMES - 1) :][:, :48]
        neurons[0].step(steady)
        neurons[1].step(turned, turn_px=16 if time == FRAMES - 1 else 0)
    g = [neuron.layers["G"] for neuron in neurons]
    assert g[0][:, 18:46].any()
    np.testing.assert_allclose(g[1][:, 2:30], g[0][:, 18:46], rtol=0.2, atol=1e-3)


@pytest.mark.parametrize("turn_px", [0.5, [1, 2], "left", None])
def test_a_turn_that_is_not_whole_is_refused(turn_px):
    neuron, frame = LGMD((HEIGHT, WIDTH)), np.zeros((HEIGHT, WIDTH), np.uint8)
    if turn_px is None:
        assert neuron.step(frame, turn_px=None).spikes == 0
        return
    with pytest.raises((ValueError, TypeError), match="turn_px must be an"):
        neuron.step(frame, turn_px=turn_px)


@pytest.mark.parametrize("params", [None, {"delay": "two-tap"}])
def test_light_enters_a_region_from_its_place_in_the_frame(params):
    """A region behaves alike in the whole view and in a view of the region with the pixels around it."""
    top, left, height, width = 3, 7, 12, 40
    whole = LGMD((HEIGHT, WIDTH), params=params, roi=(top + 1, left + 1, height - 2, width - 2))
    part = LGMD((height, width), params=params, roi=(1, 1, height - 2, width - 2))
    for time, (frame, first) in enumerate(zip(panoramas(), offsets(3), strict=True)):
        view, turn_px = frame[:, first : first + WIDTH], 5 if time else 0  # not the turn of the view
        inside = view[top : top + height, left : left + width]
        assert whole.step(view, turn_px=turn_px) == part.step(inside, turn_px=turn_px)
        for name, values in part.layers.items():
            found = whole.layers[name][top : top + height, left : left + width]
            np.testing.assert_array_equal(found, values, err_msg=name)
    assert values.any()
