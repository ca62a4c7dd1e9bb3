"""The public stepper: its answers, its errors, batches, threads, processes."""

import ast
import copy
import multiprocessing
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from golden.sequences import KINDS, looming, natural, random

import lgmd_gym.neuron
from lgmd_gym.neuron import LGMD, LGMDParams, Response

SHAPE = (24, 37)
BYTES = np.zeros(SHAPE, np.uint8)


def answers(frames, **options):
    neuron = LGMD(frames.shape[1:], **options)
    return [neuron.step(frame) for frame in frames]


def test_the_first_frame_changes_nothing():
    assert LGMD(SHAPE).step(random(SHAPE, 1)[0]) == Response(0.0, 0, 0.5, 0.5, 0.0, 0.5, 10.0, False)
    released = LGMD(SHAPE, params=LGMDParams.released()).step(BYTES)
    assert (released.membrane_potential, released.adapted_potential) == (0.0, 0.0)


def test_a_single_neuron_answers_plain_numbers():
    neuron = LGMD(SHAPE, 18.0)
    assert (neuron.shape, neuron.fps, neuron.params, neuron.num) == (SHAPE, 18.0, LGMDParams(), None)
    for frame in looming(SHAPE, 20):
        answer = neuron.step(frame)
    assert [type(value) for value in answer] == [float, int, float, float, float, float, float, bool]
    assert answer.alert
    assert answer.spike_frequency >= 30


def test_the_alert_is_the_frequency_reaching_t_sf():
    for answer in answers(looming(SHAPE, 30), params=LGMDParams(t_sf=50)):
        assert answer.alert == (answer.spike_frequency >= 50)
    loud = answers(looming(SHAPE, 30))
    assert {r.alert for r in loud} == {True, False}
    just = max(r.spike_frequency for r in loud)
    for level, reached in ((just, True), (just + 0.01, False)):
        assert any(r.alert for r in answers(looming(SHAPE, 30), params=LGMDParams(t_sf=level))) == reached


def test_a_frame_is_neither_kept_nor_changed():
    frames = natural(SHAPE, 6)
    buffer = np.empty(SHAPE, np.uint8)
    neuron, got = LGMD(SHAPE), []
    for frame in frames:
        buffer[:] = frame
        got.append(neuron.step(buffer))
        assert np.array_equal(buffer, frame)
        buffer[:] = 77
    assert got == answers(frames)


def test_any_memory_layout_and_read_only_frames():
    frames = natural(SHAPE, 6)
    plain = answers(frames)
    wide = np.zeros((6, SHAPE[0], SHAPE[1] * 2), np.uint8)
    wide[:, :, ::2] = frames
    assert answers(wide[:, :, ::2]) == plain
    assert answers(np.asfortranarray(frames)) == plain
    assert answers(frames[:, ::-1][:, ::-1]) == plain
    frames.flags.writeable = False
    assert answers(frames) == plain
    assert [LGMD(SHAPE).step(frame.tolist()) for frame in frames[:1].astype(float)] == plain[:1]


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (np.zeros((37, 24), np.uint8), r"\(37, 24\) looks transposed; this neuron takes \(24, 37\)"),
        (
            np.zeros((24, 38), np.uint8),
            r"\(24, 38\) does not fit; this neuron takes \(24, 37\) \(height, width\)",
        ),
        (np.zeros((24, 37, 3), np.uint8), "looks like colour; pass grey"),
        (np.zeros((0, 37), np.uint8), "is empty"),
        (np.zeros(SHAPE, np.int64), "dtype int64 must be uint8 or float, in 0-255"),
        (np.zeros(SHAPE, bool), "dtype bool"),
        (np.full(SHAPE, np.nan), "888 NaN or infinite pixels"),
        (np.where(np.arange(37) == 5, np.inf, 100.0) * np.ones(SHAPE), "24 NaN or infinite pixels"),
        (
            np.linspace(0, 1, 888).reshape(SHAPE),
            r"0 to 1 looks scaled to 0-1; luminance is 0-255: pass frame \* 255",
        ),
        (np.linspace(-90, 90, 888).reshape(SHAPE), "holds -90 to 90; luminance must lie in 0-255"),
    ],
)
def test_a_bad_frame_is_refused_and_leaves_the_neuron_as_it_was(frame, message):
    frames = looming(SHAPE, 12)
    neuron = LGMD(SHAPE)
    for good in frames[:6]:
        neuron.step(good)
    with pytest.raises((ValueError, TypeError), match=message) as error:
        neuron.step(frame)
    assert "\n" not in str(error.value)
    assert [neuron.step(good) for good in frames[6:]] == answers(frames)[6:]


def test_black_and_constant_float_frames_are_fine():
    neuron = LGMD(SHAPE)
    for level in (0.0, 1.0, 0.5, 255.0, 0.0):
        neuron.step(np.full(SHAPE, level))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": (0, 5)}, r"shape \(0, 5\) holds no pixel"),
        ({"shape": 5}, "shape 5 must be"),
        ({"shape": (5, 5, 3)}, "must be .height, width."),
        ({"fps": 0}, "fps = 0 must be > 0"),
        ({"fps": -30}, "fps = -30 must be > 0"),
        ({"fps": float("nan")}, "fps = nan"),
        ({"num": 0}, "num = 0 must be >= 1"),
        ({"num": 2.5}, "num = 2.5 must be a whole number"),
        ({"threads": 0}, "threads = 0 must be >= 1"),
        ({"params": {"t_sp": 0.7}}, "params must be LGMDParams, not dict; see LGMDParams.from_dict"),
        ({"mask": np.zeros(SHAPE)}, "mask is 0 everywhere"),
        ({"mask": np.ones((3, 3))}, r"mask of shape \(3, 3\) does not fit"),
        ({"mask": np.full(SHAPE, 1.5)}, r"mask holds 1.5 to 1.5; weights must lie in \[0, 1\]"),
        ({"mask": np.full(SHAPE, np.nan)}, "mask holds nan"),
        ({"mask": np.ones(SHAPE), "roi": (0, 0, 2, 2)}, "give mask or roi, not both"),
        ({"roi": (20, 0, 10, 5)}, r"roi \(20, 0, 10, 5\), .* leaves the frame of \(24, 37\)"),
    ],
)
def test_bad_arguments_are_refused(options, message):
    with pytest.raises((ValueError, TypeError), match=message) as error:
        LGMD(**{"shape": SHAPE, **options})
    assert "\n" not in str(error.value)


def test_a_reset_neuron_is_a_new_one():
    frames = looming(SHAPE, 20)
    for params in (LGMDParams(), LGMDParams.released(), LGMDParams.yue_rind2006()):
        neuron = LGMD(SHAPE, params=params)
        first = [neuron.step(frame) for frame in frames]
        neuron.reset()
        assert not any(image.any() for image in neuron.layers.values())
        assert [neuron.step(frame) for frame in frames] == first


def batch(num, count=12, shape=SHAPE):
    makers = list(KINDS.values())
    return np.stack([makers[i % 4](shape, count) for i in range(num)], axis=1)


@pytest.mark.parametrize("threads", [None, 2, 3, 8])
@pytest.mark.parametrize("params", [LGMDParams(), LGMDParams.released()])
def test_a_batch_answers_as_its_single_neurons(threads, params):
    frames = batch(5)
    together, singles = (
        LGMD(SHAPE, params=params, num=5, threads=threads),
        [LGMD(SHAPE, params=params) for _ in range(5)],
    )
    for stack in frames:
        answer = together.step(stack)
        for i, (neuron, frame) in enumerate(zip(singles, stack, strict=True)):
            assert Response(*(field[i] for field in answer)) == neuron.step(frame)
    for name, images in together.layers.items():
        assert np.array_equal(images, [neuron.layers[name] for neuron in singles])


def test_the_arrays_of_a_batch_are_fresh():
    frames = batch(4)
    neuron = LGMD(SHAPE, num=4)
    kept = [neuron.step(stack) for stack in frames]
    copies = [[field.copy() for field in answer] for answer in kept]
    layers = neuron.layers
    before = {name: image.copy() for name, image in layers.items()}
    for stack in frames:
        for field in neuron.step(stack):
            field[:] = 0
    assert all(
        np.array_equal(a, b) for x, y in zip(kept, copies, strict=True) for a, b in zip(x, y, strict=True)
    )
    assert all(np.array_equal(layers[name], before[name]) for name in layers)
    assert [field.dtype.name for field in kept[0]] == ["float64", "int64", *["float64"] * 5, "bool"]


def test_a_batch_of_one_answers_arrays():
    assert LGMD(SHAPE, num=1).step(BYTES[None]).spikes.shape == (1,)
    with pytest.raises(ValueError, match=r"takes \(1, 24, 37\) \(num, height, width\)"):
        LGMD(SHAPE, num=1).step(BYTES)


def test_reset_of_some_leaves_the_others():
    frames, which = batch(4, 16), np.array([True, False, True, False])
    neuron, steady = LGMD(SHAPE, num=4), LGMD(SHAPE, num=4)
    for stack in frames[:8]:
        neuron.step(stack)
        steady.step(stack)
    neuron.reset(which)
    fresh = LGMD(SHAPE, num=4)
    for stack in frames[8:]:
        got, new, old = neuron.step(stack), fresh.step(stack), steady.step(stack)
        for a, b, c in zip(got, new, old, strict=True):
            assert np.array_equal(a, np.where(which, b, c))


def test_neurons_that_are_not_active_stay_as_they_are():
    frames, active = batch(4), np.array([True, True, False, False])
    neuron, singles = LGMD(SHAPE, num=4), [LGMD(SHAPE) for _ in range(4)]
    last = [singles[i].step(frames[0][i]) for i in range(4)]
    neuron.step(frames[0])
    for turn, stack in enumerate(frames[1:]):
        chosen = np.roll(active, turn)
        stack = np.where(chosen[:, None, None], stack.astype(float), np.nan)
        answer = neuron.step(stack, active=chosen)
        last = [singles[i].step(stack[i]) if chosen[i] else last[i] for i in range(4)]
        assert [Response(*(field[i] for field in answer)) for i in range(4)] == last


@pytest.mark.parametrize("which", [[1, 0, 1, 0], [True, False], np.ones((4, 1), bool), True])
def test_a_choice_of_neurons_is_checked(which):
    neuron = LGMD(SHAPE, num=4)
    with pytest.raises(ValueError, match=r"must be bool of shape \(4,\)"):
        neuron.reset(which)
    with pytest.raises(ValueError, match=r"active .* must be bool of shape \(4,\)"):
        neuron.step(np.zeros((4, *SHAPE), np.uint8), active=which)


def test_a_region_is_a_mask_of_ones():
    frames, mask = looming(SHAPE, 20), np.zeros(SHAPE)
    mask[3:20, 5:30] = 1
    assert answers(frames, mask=mask) == answers(frames, roi=(3, 5, 17, 25))
    neuron = LGMD(SHAPE, roi=(3, 5, 17, 25))
    for frame in frames:
        neuron.step(frame)
    assert neuron.layers["P"].shape == SHAPE
    assert not (neuron.layers["P"] * (1 - mask)).any()


@pytest.mark.parametrize("clone", [copy.deepcopy, lambda n: pickle.loads(pickle.dumps(n))])
def test_a_copy_goes_its_own_way(clone):
    frames = looming(SHAPE, 20)
    neuron = LGMD(SHAPE, threads=2)
    for frame in frames[:10]:
        neuron.step(frame)
    other = clone(neuron)
    rest = [neuron.step(frame) for frame in frames[10:]]
    assert [other.step(frame) for frame in frames[10:]] == rest


def test_golden_traces():
    with np.load(Path(__file__).parents[1] / "golden" / "neuron.npz") as traces:
        assert len(traces) == 5 * len(KINDS)
        for name, wanted in traces.items():
            preset, kind = name.split("-")
            params = LGMDParams() if preset == "default" else getattr(LGMDParams, preset)()
            got = np.array(answers(KINDS[kind]((45, 80), 40), params=params), float)
            np.testing.assert_allclose(got, wanted, rtol=1e-5, atol=1e-4, err_msg=name)


def test_the_golden_traces_are_the_references():
    from golden.sequences import looming as frames

    from lgmd_gym.neuron.reference import ReferenceLGMD

    with np.load(Path(__file__).parents[1] / "golden" / "neuron.npz") as traces:
        wanted = traces["default-looming"]
    assert wanted[:, 1].max() >= 5
    neuron = ReferenceLGMD((45, 80))
    got = np.array([neuron.step(frame) for frame in frames((45, 80), 40)], float)
    np.testing.assert_allclose(got, wanted, rtol=1e-9)


def test_a_single_neuron_starts_no_thread():
    from numba.np.ufunc import parallel

    before = threading.active_count()
    answers(natural(SHAPE, 3))
    LGMD(SHAPE, num=3).step(np.zeros((3, *SHAPE), np.uint8))
    LGMD(SHAPE, threads=4).step(BYTES)
    assert threading.active_count() == before
    assert not parallel._is_initialized


def _forked(queue, neuron, frames):
    queue.put([tuple(map(np.ndarray.tolist, neuron.step(stack))) for stack in frames])


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize("threads", [None, 2])
def test_a_forked_child_steps_on_after_its_parent_has(threads):
    context = multiprocessing.get_context("fork")
    frames, neuron = batch(4), LGMD(SHAPE, num=4, threads=threads)
    for stack in frames[:6]:
        neuron.step(stack)
    queue = context.SimpleQueue()
    child = context.Process(target=_forked, args=(queue, neuron, frames[6:]), daemon=True)
    child.start()
    child.join(60)
    assert child.exitcode == 0
    assert queue.get() == [tuple(map(np.ndarray.tolist, neuron.step(stack))) for stack in frames[6:]]


SECOND_PROCESS = """
import time
start = time.perf_counter()
import numpy as np
from lgmd_gym.neuron import LGMD, LGMDParams
for params in (LGMDParams(), LGMDParams.released()):
    neuron = LGMD((90, 160), params=params)
    for level in (0, 90, 20):
        answer = neuron.step(np.full((90, 160), level, np.uint8) + np.arange(160, dtype=np.uint8) // 2)
print(time.perf_counter() - start, repr(answer))
"""


def test_a_second_process_starts_from_the_cache_and_answers_the_same():
    runs = [
        subprocess.run(
            [sys.executable, "-c", SECOND_PROCESS], capture_output=True, text=True, check=True
        ).stdout
        for _ in range(3)
    ]
    assert min(float(run.split()[0]) for run in runs[1:]) < 1.5
    assert len({run.split(maxsplit=1)[1] for run in runs}) == 1


def test_the_neuron_knows_numpy_and_numba_only():
    allowed = {"numpy", "numba", "llvmlite", "lgmd_gym", *sys.stdlib_module_names}
    for path in Path(lgmd_gym.neuron.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            for name in names:
                assert name.split(".")[0] in allowed, (path.name, name)
                if name.startswith("lgmd_gym"):
                    assert name.startswith("lgmd_gym.neuron") or name == "lgmd_gym.errors", (path.name, name)
