"""Properties of the neuron that hold for every sequence of frames."""

import hypothesis.extra.numpy as arrays
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from support.neurons import PRESETS, responses

from lgmd_gym.neuron import LGMD, LGMDParams

PARAMS = st.sampled_from([*PRESETS.values(), LGMDParams(t_de=0.0, sigma_3=0.01)])
FPS = st.sampled_from([5.0, 15.0, 18.0, 30.0, 60.0, 240.0])


@st.composite
def sequences(draw):
    """Generate a few small frames: random bytes, or growing squares, which cause spikes more often."""
    count, height, width = draw(st.integers(2, 8)), draw(st.integers(1, 12)), draw(st.integers(1, 40))
    if draw(st.booleans()):
        return draw(arrays.arrays(np.uint8, (count, height, width)))
    inner, outer = draw(st.integers(0, 255)), draw(st.integers(0, 255))
    frames = np.full((count, height, width), outer, np.uint8)
    for i in range(count):
        frames[i, : i * height // count, : i * width // count] = inner
    return frames


def run(frames, params=None, fps=30.0):
    return np.array(responses(frames, fps=fps, params=params), float)


@settings(deadline=None)
@given(sequences(), PARAMS, FPS)
def test_outputs_stay_within_their_bounds(frames, params, fps):
    outputs = run(frames, params, fps)
    assert np.isfinite(outputs).all()
    frequency, spikes, k, k_hat, f, w, latency, alert = outputs.T
    assert (k[1:] >= 0.5).all()
    assert (k <= 1.0).all()
    assert (k_hat <= 1.0).all()
    assert (k_hat[1:] >= 0.5).all()
    assert (spikes >= 0).all()
    assert (spikes == spikes.round()).all()
    assert (f >= 0).all()
    assert (w >= params.sigma_1).all()
    assert ((latency >= 0) & (latency <= params.tau_g)).all()
    assert ((frequency >= params.t_sf) == alert).all()


@given(st.integers(0, 255), st.integers(1, 12), st.integers(1, 40), PARAMS)
@settings(deadline=None)
def test_static_scene_causes_no_excitation(level, height, width, params):
    out = run(np.full((5, height, width), level, np.uint8), params)
    assert (out[1:, 2:4] == 0.5).all()
    assert (out[:, [0, 1, 4, 7]] == 0).all()


@settings(deadline=None)
@given(sequences(), FPS)
def test_polarity_has_no_effect(frames, fps):
    np.testing.assert_allclose(run(frames, fps=fps), run(255 - frames, fps=fps), rtol=0, atol=1e-6)


@settings(deadline=None)
@given(
    sequences(),
    PARAMS,
    st.sampled_from([(slice(None), slice(None, None, -1)), (slice(None, None, -1), slice(None))]),
)
def test_mirrored_frames_give_equal_outputs(frames, params, axes):
    np.testing.assert_allclose(run(frames, params), run(frames[:, *axes], params), rtol=1e-4, atol=1e-4)


@settings(deadline=None)
@given(sequences(), sequences(), PARAMS)
def test_reset_neuron_equals_a_new_one(first, second, params):
    second = np.resize(second, (len(second), *first.shape[1:]))
    neuron = LGMD(first.shape[1:], params=params)
    for frame in first:
        neuron.step(frame)
    neuron.reset()
    assert np.array_equal([neuron.step(frame) for frame in second], run(second, params))


@settings(deadline=None)
@given(sequences())
def test_repeated_frame_ends_in_no_spikes(frames):
    still = np.repeat(frames[-1:], 200, axis=0)
    assert run(np.concatenate([frames, still]))[-1, 1] == 0
