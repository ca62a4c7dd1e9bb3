"""Operations and bytes per pixel of the fast kernel: the numbers of docs/neuron.md."""

from pathlib import Path
from types import FunctionType

import numpy as np
import pytest

from lgmd_gym import LGMD, LGMDParams
from lgmd_gym.kernels.simd import LANES
from lgmd_gym.neuron.lgmd import general, kernels

PAGE = " ".join((Path(__file__).parents[2] / "docs" / "neuron.md").read_text(encoding="utf-8").split())
KERNELS = ("_at", "_replicate_sides", "_photoreceptors", "_clear_tiny", "_clear_row", "_is_still",
           "_delayed", "_summation", "_local_means", "_inhibition", "_grouping", "step")  # fmt: skip


class Lanes:
    """Sixteen lanes that count the operations on them, one per lane."""

    operations = 0

    def __init__(self, values, operations=0):
        self.values = np.broadcast_to(np.asarray(values, np.float32), LANES)
        Lanes.operations += operations * LANES

    def __add__(self, other):
        return Lanes(self.values + other.values, 1)

    def __sub__(self, other):
        return Lanes(self.values - other.values, 1)

    def __mul__(self, other):
        return Lanes(self.values * other.values, 1)


def flat(array):
    return array.reshape(-1)  # a view: the maps are contiguous


def store(array, index, lanes):
    flat(array)[index : index + LANES] = lanes.values


def copy(source, start, target, index):
    flat(target)[index : index + LANES] = flat(source)[start : start + LANES]


VECTORS = {
    "splat": Lanes,
    "load": lambda array, index: Lanes(flat(array)[index : index + LANES]),
    "store": store,
    "copy": copy,
    "madd": lambda a, b, c: Lanes(a.values * b.values + c.values, 2),
    "magnitude": lambda a: Lanes(np.abs(a.values), 1),
    "maximum": lambda a, b: Lanes(np.maximum(a.values, b.values), 1),
    "select_by_sign": lambda sign, a, b: Lanes(np.where(sign.values >= 0, a.values, b.values), 1),
    "at_least": lambda a, low: Lanes(np.where(a.values >= low.values, a.values, 0), 1),
    "clear_below": lambda a, low: Lanes(np.where(np.abs(a.values) >= low.values, a.values, 0)),
    "prefetch": lambda array, index: None,
    "total": lambda a: a.values.sum(),
    "largest": lambda a: a.values.max(),
}


def counting_step():
    """The kernel `step` in Python, on lanes that count."""
    space = dict(vars(kernels)) | VECTORS
    for name in KERNELS:
        space[name] = FunctionType(getattr(kernels, name).py_func.__code__, space)
    for name in ("feed_forward", "fire"):
        space[name] = vars(kernels)[name]
    return space["step"]


def operations_per_pixel(frames):
    """Operations of the last frame, and the scalars of the neuron after it."""
    height, width = frames[0].shape
    neuron = LGMD((height, width))
    step, maps = counting_step(), kernels.allocate(1, (height, width))
    previous, weight = np.zeros((1, height, width), np.uint8), np.zeros((0, 0), np.float32)
    for frame in frames:
        Lanes.operations = 0
        arguments = (0, 1, frame[None], previous, 0, 0, weight, np.ones(1, bool), neuron._scalars)
        step(*arguments, neuron._const, *maps)
    return Lanes.operations / (height * width), neuron._scalars.copy()


def test_operations_per_pixel():
    """71 in rows with a change, 8 more in those that can pass the grouping threshold, 7 in all others."""
    still = np.full((20, 32), 127, np.uint8)
    bar, weak = still.copy(), still.copy()
    bar[:, 14:17], weak[:, 14:17] = 20, 126  # in every row
    frames = [still, still, bar]
    count, scalars = operations_per_pixel(frames)
    assert count == 79
    assert operations_per_pixel([still, still, weak])[0] == 71
    assert operations_per_pixel([still] * 3)[0] == 7
    neuron = LGMD((20, 32))
    response = [neuron.step(frame) for frame in frames][-1]
    assert scalars[0, 2] == pytest.approx(response.membrane_potential, abs=1e-6)  # the same computation
    assert response.membrane_potential > 0.7
    assert "71 operations per pixel" in PAGE
    assert "8 more" in PAGE
    assert "7 in rows without a change" in PAGE
    assert f"{99 * 72 * 79 * 30 / 1e6:.0f} million operations per second" in PAGE


def test_bytes_per_pixel():
    """Of a width without padding; the borders of P are left out."""
    height, width = 48, 64
    p, memory, s, products, g, rows = kernels.allocate(1, (height, width))
    pixels = height * width
    previous = LGMD((height, width))._previous
    parts = {"last frame": previous.nbytes, "P": 2 * 4 * pixels, "E": memory.nbytes, "G": g.nbytes}
    assert {name: size / pixels for name, size in parts.items()} == {
        "last frame": 1, "P": 8, "E": 24, "G": 4
    }  # fmt: skip
    assert p.shape[1] == 2
    assert p.nbytes >= parts["P"]
    assert sum(parts.values()) == 37 * pixels
    state = 37 * 99 * 72
    assert state > 256 * 1024
    assert f"{state:,} bytes" in PAGE
    used = sum(array.nbytes for array in kernels.allocate(1, (72, 99))) + 72 * 99
    assert f"{used / 1000:.0f} kB" in PAGE
    assert products.nbytes == 4 * pixels  # scratch memory, which the neurons of a batch share
    assert s.nbytes + rows.nbytes < 4 * pixels


def test_bytes_per_pixel_of_the_general_kernel():
    sizes = [array.nbytes for array in general.allocate(1, (100, 1000), LGMDParams().n_p)]
    assert sum(sizes) / 1e5 == pytest.approx(56, rel=0.05)  # 5 % for the borders


def edge_frames(start, speed, acceleration=0.0, shape=(30, 400), count=40):
    """A dark edge that moves to the right [px, px/frame, px/frame²]."""
    for number in range(count):
        position = start + speed * number + 0.5 * acceleration * number**2
        covered = np.clip(position - np.arange(shape[1]), 0.0, 1.0)
        yield np.tile(np.rint(127.5 - 107.5 * covered), (shape[0], 1)).astype(np.uint8)


def shares_left(frames):
    """S / E of each frame from the tenth on."""
    neuron = LGMD((30, 400))
    shares = []
    for frame in frames:
        neuron.step(frame)
        shares.append(neuron.layers["S"].sum() / max(neuron.layers["E"].sum(), 1e-9))
    return np.array(shares[10:])


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 4.0, 8.0])
def test_the_inhibition_does_not_cancel_an_edge_at_constant_speed(speed):
    """It leaves about 43 % of the excitation of any edge, also of an accelerating one."""
    assert shares_left(edge_frames(20.0, speed)).mean() == pytest.approx(0.43, abs=0.02)
    accelerating = edge_frames(20.0, 0.5, 0.1 * speed, count=28)
    assert shares_left(accelerating).mean() == pytest.approx(0.43, abs=0.03)


def test_the_adaptation_silences_an_edge_at_constant_speed():
    neuron = LGMD((30, 400))
    responses = [neuron.step(frame) for frame in edge_frames(20.0, 4.0, count=60)]
    assert min(response.membrane_potential for response in responses[10:]) > 0.8
    assert max(response.adapted_potential for response in responses[30:]) < 0.7
    assert sum(response.spikes for response in responses[30:]) == 0
