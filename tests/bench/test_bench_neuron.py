"""Speed of the neuron: `pytest -m bench tests/bench/test_bench_neuron.py --benchmark-json=neuron.json`.

Memory traffic of the fast kernel with uint8 frames, per pixel and frame:

    frame 1 read, previous luminance 1 read + 1 write, P of two frames 8 read + 4 write    15 bytes
    P again with its rings 4 read, six delayed maps 24 read + 24 write                     52 bytes
    S and S * Ce of rows that stay in the first-level cache                                 0 bytes
    G and S * Ce again, only in rows with values above the grouping threshold               0 to 16 bytes

The sum is about 67 bytes (38 read, 29 written) for roughly 55 float operations. At 160x90, a step moves 1
MB from the second-level cache; its 32 bytes per cycle at 3.5 GHz (110 GB/s) allow 9 us. The arithmetic with
16 lanes and two pipes takes 7 us and overlaps. At 352x288, the maps (3.8 MB) are in the third-level cache
with 60 to 110 GB/s, which bounds a step to 60 to 110 us. At 1080p, the 139 MB of a step come from main
memory, from which one core of a server reads 15 to 40 GB/s: 3.5 to 9 ms. Delayed maps with 16 bits per
value would reduce 48 of the 67 bytes, but their rounding changes K by more than 1e-4.
`test_memory_bandwidth` measures a copy on this machine and prints both.

Ratios are those of interleaved medians of one run, so that a busy machine slows both sides.
"""

import itertools
import statistics
import time

import numpy as np
import pytest
from support.opencv_lgmd import OpenCVLGMD, TunedOpenCVLGMD

from lgmd_gym.neuron import LGMD, LGMDParams

pytestmark = pytest.mark.bench
SMALL, CIF, FULL = (90, 160), (288, 352), (1080, 1920)
BYTES_PER_PIXEL = 67


def scene(shape, count=20, seed=0):
    """Return a drifting texture of several scales with sensor noise, uint8, (count, H, W)."""
    rng = np.random.default_rng(seed)
    size = (shape[0] + 2 * count, shape[1] + 2 * count)
    image = np.zeros(size)
    for step in (64, 16, 4, 1):
        coarse = rng.normal(size=(size[0] // step + 1, size[1] // step + 1))
        image += np.kron(coarse, np.ones((step, step)))[: size[0], : size[1]] * 12 * step**0.3
    frames = np.stack([image[i : i + shape[0], 2 * i : 2 * i + shape[1]] for i in range(count)])
    return np.clip(frames + 110 + rng.normal(0, 2, frames.shape), 0, 255).astype(np.uint8)


def medians(*steps, frames, rounds=15):
    """Return the median seconds per frame of each step function, with interleaved rounds."""
    times = [[] for _ in steps]
    for number in range(rounds + 2):
        for i, step in enumerate(steps):
            start = time.perf_counter()
            for frame in frames:
                step(frame)
            if number >= 2:  # after two warm-up rounds
                times[i].append((time.perf_counter() - start) / len(frames))
    return [statistics.median(t) for t in times]


@pytest.mark.parametrize("shape", [SMALL, CIF, FULL])
@pytest.mark.parametrize("preset", ["default", "released"])
def test_step(benchmark, shape, preset):
    frames = scene(shape)
    neuron = LGMD(shape, params=LGMDParams() if preset == "default" else LGMDParams.released())
    number = itertools.count()
    benchmark(lambda: neuron.step(frames[next(number) % len(frames)]))


def test_step_at_160x90_takes_at_most_25_us():
    (seconds,) = medians(LGMD(SMALL).step, frames=scene(SMALL), rounds=100)
    print(f"\n160x90: {seconds * 1e6:.1f} us a step")
    assert seconds <= 25e-6


@pytest.mark.parametrize("shape", [SMALL, CIF])
def test_eight_times_faster_than_opencv(shape):
    frames, neuron = scene(shape), LGMD(shape)
    plain, tuned = OpenCVLGMD(shape), TunedOpenCVLGMD(shape)
    for frame in frames:
        response = neuron.step(frame)
        for k, spikes in (plain.step(frame), tuned.step(frame)):
            # A pixel close to the grouping threshold may pass in one model only.
            assert response.membrane_potential == pytest.approx(k, abs=1e-4 + 60 / (4 * frame.size))
            assert response.spikes == spikes
    a, b, c = medians(neuron.step, plain.step, tuned.step, frames=frames)
    size = f"{shape[1]}x{shape[0]}"
    print(f"\n{size}: {a * 1e6:.1f} us; OpenCV and NumPy {b * 1e6:.0f} us, {b / a:.1f} times", end="; ")
    print(f"tuned OpenCV {c * 1e6:.0f} us, {c / a:.1f} times")
    assert b >= 8 * a
    assert c >= 3 * a


def test_cost_is_linear_in_pixels():
    costs = {}
    for shape in (SMALL, CIF, (480, 640), (720, 1280), FULL):
        (seconds,) = medians(LGMD(shape).step, frames=scene(shape, 6), rounds=7)
        costs[shape] = seconds * 1e9 / (shape[0] * shape[1])
    print("\n" + ", ".join(f"{w}x{h}: {ns:.2f} ns/px" for (h, w), ns in costs.items()))
    # Beyond the caches, main memory makes each pixel more expensive by a constant factor.
    assert max(costs.values()) < 4 * min(costs.values())


def test_two_threads_on_a_batch_of_64():
    frames = np.stack([scene(SMALL, 4, seed) for seed in range(64)], axis=1)
    alone, shared = LGMD(SMALL, num=64), LGMD(SMALL, num=64, threads=2)
    # The best of three runs, because other processes on the second core only lower the ratio.
    runs = [medians(alone.step, shared.step, frames=frames, rounds=25) for _ in range(3)]
    a, b = max(runs, key=lambda run: run[0] / run[1])
    each = f"{a * 1e6 / 64:.1f} us a neuron alone, {b * 1e6 / 64:.1f} with two threads"
    print(f"\nbatch of 64: {each}, {a / b:.2f} times")
    assert a >= 1.8 * b


def test_memory_bandwidth():
    for shape in (SMALL, CIF, FULL):
        frames = scene(shape, 6)
        pixels = shape[0] * shape[1]
        # A copy between maps of the neuron's size: half read, half written, from the same caches.
        maps = np.zeros((2, BYTES_PER_PIXEL // 8, pixels), np.float32)
        step, copy = medians(LGMD(shape).step, lambda _, m=maps: np.copyto(m[1], m[0]), frames=frames)
        moved = BYTES_PER_PIXEL * pixels / step
        bound = maps.nbytes / copy
        share = f"{moved / 1e9:.0f} GB/s, a copy {bound / 1e9:.0f} GB/s: {moved / bound:.0%}"
        print(f"\n{shape[1]}x{shape[0]}: {share}")
        assert moved > 0.1 * bound
