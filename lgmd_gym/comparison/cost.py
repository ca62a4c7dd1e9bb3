"""Time and memory of the models for one frame."""

import math
import time
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from lgmd_gym import neuron
from lgmd_gym.neuron import FrameNeuron
from lgmd_gym.paper.backgrounds import Panorama, Screen
from lgmd_gym.paper.stimuli import Looming, stimulus_frames

SHAPE = (90, 160)  # of the camera `fovea` [px]
BATCH = 16  # neurons of a step of the engine


class Cost(NamedTuple):
    """Cost of one model on one core."""

    model: str
    single_us: float  # time of a step of one neuron, fastest round [µs]
    batch_us: float  # time of a step of `BATCH` neurons, divided by them [µs]
    state_bytes: int  # size of the arrays of one neuron [bytes]

    @property
    def bytes_per_px(self) -> float:
        """Size of the state per pixel [bytes]."""
        return self.state_bytes / (SHAPE[0] * SHAPE[1])


def measure(models: Sequence[str], rounds: int = 15, frames: int = 60) -> list[Cost]:
    """Return the cost of models for frames of 160×90 px: a looming square on a shifting panorama.

    Args:
        models: Specifications of the models.
        rounds: Number of rounds; the fastest counts, because others share the machine.
        frames: Number of frames of a round.
    """
    screen, square = Screen(shape=SHAPE), Looming(contact=frames / 30.0 + 0.1)
    pictures = list(stimulus_frames(screen, frames / 30.0, Panorama(), square))
    batches = [np.repeat(picture[None], BATCH, axis=0) for picture in pictures[: max(frames // BATCH, 2)]]
    single = {name: neuron.make(name, SHAPE) for name in models}
    batch = {name: neuron.make(name, SHAPE, num=BATCH) for name in models}
    for name in models:  # the first steps compile
        single[name].step(pictures[0])
        batch[name].step(batches[0])
    fastest = dict.fromkeys(models, (math.inf, math.inf))
    for _ in range(rounds):  # one model after the other, so that a busy moment does not meet one alone
        for name in models:
            seconds = _seconds(single[name], pictures), _seconds(batch[name], batches)
            fastest[name] = min(fastest[name][0], seconds[0]), min(fastest[name][1], seconds[1])
    return [
        Cost(
            name,
            1e6 * fastest[name][0] / len(pictures),
            1e6 * fastest[name][1] / len(batches) / BATCH,
            state_bytes(single[name]),
        )
        for name in models
    ]


def _seconds(model: FrameNeuron, frames: Sequence[np.ndarray]) -> float:
    model.reset()
    start = time.perf_counter()
    for frame in frames:
        model.step(frame)
    return time.perf_counter() - start


def state_bytes(model: object) -> int:
    """Return the size of all arrays that a model holds, those of its parts included [bytes].

    Arrays are objects with `nbytes`, as of NumPy and torch. A view counts as the array that it shows.
    """
    sizes: dict[int, int] = {}
    seen: set[int] = set()
    todo: list[object] = [model]
    while todo:
        item = todo.pop()
        if id(item) in seen or isinstance(item, str | bytes | type):
            continue
        seen.add(id(item))
        nbytes = getattr(item, "nbytes", None)
        if isinstance(nbytes, int):
            base: Any = item
            while hasattr(getattr(base, "base", None), "nbytes"):
                base = base.base
            sizes[id(base)] = max(sizes.get(id(base), 0), int(getattr(base, "nbytes", nbytes)))
        elif isinstance(item, Mapping):
            todo += item.values()  # pyright: ignore[reportUnknownArgumentType, reportUnknownMemberType]
        elif isinstance(item, list | tuple):
            todo += item  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
        else:
            todo += getattr(item, "__dict__", {}).values()
    return sum(sizes.values())
