"""Threads, forked processes, the compilation cache and the imports of the neuron."""

import ast
import multiprocessing
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from golden.sequences import natural

import lgmd_gym.neuron
from lgmd_gym.neuron import LGMD

SHAPE = (24, 37)


def test_step_starts_no_thread_for_a_single_neuron():
    from numba.np.ufunc import parallel

    before = threading.active_count()
    frames = natural(SHAPE, 3)
    for frame in frames:
        LGMD(SHAPE).step(frame)
        LGMD(SHAPE, threads=4).step(frame)
        LGMD(SHAPE, num=3).step(frames)
    assert threading.active_count() == before
    assert not parallel._is_initialized


def _step_and_send(queue, neuron, frames):
    queue.put([tuple(map(np.ndarray.tolist, neuron.step(stack))) for stack in frames])


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize("threads", [None, 2])
def test_forked_child_continues_the_neuron_of_its_parent(threads):
    context = multiprocessing.get_context("fork")
    frames = np.stack([natural(SHAPE, 12, seed) for seed in range(4)], axis=1)
    neuron = LGMD(SHAPE, num=4, threads=threads)
    for stack in frames[:6]:
        neuron.step(stack)
    queue = context.SimpleQueue()
    child = context.Process(target=_step_and_send, args=(queue, neuron, frames[6:]), daemon=True)
    child.start()
    child.join(60)
    assert child.exitcode == 0
    assert queue.get() == [tuple(map(np.ndarray.tolist, neuron.step(stack))) for stack in frames[6:]]


OTHER_PROCESS = """
import numpy as np
from lgmd_gym.neuron import LGMD, LGMDParams
from lgmd_gym.neuron.lgmd import general, kernels
for params in (LGMDParams(), LGMDParams.released()):
    neuron = LGMD((90, 160), params=params)
    for level in (0, 90, 20):
        response = neuron.step(np.full((90, 160), level, np.uint8) + np.arange(160, dtype=np.uint8) // 2)
hits = [sum(module.step.stats.cache_hits.values()) for module in (kernels, general)]
print(*hits, repr(response))
"""


def test_other_processes_use_the_compilation_cache_and_get_equal_outputs():
    command = [sys.executable, "-c", OTHER_PROCESS]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert runs[1].startswith("1 1 ")  # both kernels are loaded, not compiled
    assert len({run.split(maxsplit=2)[2] for run in runs}) == 1


def test_neuron_imports_only_errors_fields_and_kernels():
    allowed = {"numpy", "numba", "llvmlite", "tomli_w", *sys.stdlib_module_names}
    imported = set()
    for path in Path(lgmd_gym.neuron.__file__).parent.rglob("*.py"):
        if path.stem == "lgmd_torch":  # needs the extra "train"; no other module imports it
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module or "")
    below = (
        "lgmd_gym.processes.inputs",
        "lgmd_gym.processes.user_modules",
        "lgmd_gym._version",
        "lgmd_gym.aliases",
        "lgmd_gym.errors",
        "lgmd_gym.fields",
        "lgmd_gym.kernels",
    )
    own = {name for name in imported if name.startswith(("lgmd_gym.neuron", *below))}
    assert {name for name in imported - own if name.split(".")[0] not in allowed} == set()
    assert "lgmd_gym.neuron.lgmd_torch" not in imported
