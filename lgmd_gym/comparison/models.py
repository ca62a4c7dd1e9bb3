"""The models of a comparison: their specifications, and their outputs for the same frames."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from lgmd_gym import neuron
from lgmd_gym.neuron import FrameNeuron
from lgmd_gym.paper.stimuli import Frame

PAGE_MODELS = (
    *("lgmd", "literal", "released", "fixed-inhibition", "off-only", "adaptive-threshold", "events"),
    *("lplc2", "dsn", "edges", "difference"),
)
"""The models of the page "Which neuron?"."""
SIGNALS = ("spike_frequency", "membrane_potential")


def checked_models(models: Iterable[str], shape: tuple[int, int]) -> tuple[str, ...]:
    """Return the distinct specifications after making each model once.

    Args:
        models: Specifications, see `lgmd_gym.neuron.check_model`.
        shape: (height, width) of the frames [px].

    Raises:
        ValueError: For an unknown model or option, a value out of range, or no model.
    """
    names = tuple(dict.fromkeys(models))
    if not names:
        raise ValueError("a neuron model is required, as in lgmd-gym neurons compare lgmd off-only")
    for name in names:
        neuron.make(name, shape)
    return names


def step_models(
    models: Sequence[str], frames: Iterable[Frame], fps: float
) -> dict[str, dict[str, NDArray[np.float64]]]:
    """Return `SIGNALS` of several models for the same frames, which are taken once.

    Args:
        models: Specifications of the models.
        frames: Grey frames, uint8, shape (height, width).
        fps: Frame rate [Hz].

    Returns:
        For each model, each signal as an array of shape (frames,).
    """
    neurons: Mapping[str, FrameNeuron] = {}
    values: dict[str, list[tuple[float, ...]]] = {name: [] for name in models}
    for frame in frames:
        if not neurons:
            neurons = {name: neuron.make(name, (frame.shape[0], frame.shape[1]), fps) for name in models}
        for name, model in neurons.items():
            response = model.step(frame)
            values[name].append(tuple(float(getattr(response, signal)) for signal in SIGNALS))
    return {
        name: dict(zip(SIGNALS, np.array(rows, float).reshape(-1, len(SIGNALS)).T, strict=True))
        for name, rows in values.items()
    }
