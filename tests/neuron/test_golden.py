"""Golden traces, which the reference model has written (see `tests.golden.make`)."""

from pathlib import Path

import numpy as np
from golden.sequences import KINDS
from support.neurons import PRESETS, responses

from lgmd_gym.neuron.lgmd.reference import ReferenceLGMD

TRACES = Path(__file__).parents[1] / "golden" / "neuron.npz"
SHAPE, COUNT = (45, 80), 40


def test_kernels_reproduce_the_golden_traces():
    with np.load(TRACES) as traces:
        assert set(traces) == {f"{preset}-{kind}" for preset in PRESETS for kind in KINDS}
        for name, expected in traces.items():
            preset, kind = name.split("-")
            got = np.array(responses(KINDS[kind](SHAPE, COUNT), params=PRESETS[preset]), float)
            np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-4, err_msg=name)


def test_reference_reproduces_the_golden_trace_of_a_looming_object():
    with np.load(TRACES) as traces:
        expected = traces["default-looming"]
    assert expected[:, 1].max() >= 5  # spikes
    neuron = ReferenceLGMD(SHAPE)
    got = np.array([neuron.step(frame) for frame in KINDS["looming"](SHAPE, COUNT)], float)
    np.testing.assert_allclose(got, expected, rtol=1e-9)
