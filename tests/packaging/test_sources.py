"""The stamp of a kernel covers all sources that it depends on, in every room."""

import importlib
import pkgutil
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.registry import CPUDispatcher

import lgmd_gym
from lgmd_gym.kernels import sources
from lgmd_gym.kernels.kernel import Kernel

ROOT = Path(lgmd_gym.__file__).parent
STAMPS = (
    "import sys; from lgmd_gym.kernels.sources import source_stamp; print(*map(source_stamp, sys.argv[1:]))"
)
DSN = """
import numpy as np
from lgmd_gym import neuron
model = neuron.make("dsn", (24, 32), 30.0)
wide = np.random.default_rng(1).integers(0, 255, (24, 80)).astype(np.uint8)
for shift in range(0, 48, 6):
    response = model.step(wide[:, shift : shift + 32].copy())
print(response.spike_frequency)
"""


def kernels():
    """Yield every kernel of the package with its module."""
    names = [item.name for item in pkgutil.walk_packages([str(ROOT)], "lgmd_gym.")]
    for name in names:
        file = sources._file_of(name)
        if file is None or b"kernel" not in file.read_bytes():
            continue
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        for value in vars(module).values():
            if isinstance(value, CPUDispatcher) and value.py_func.__module__ == name:
                yield name, value


def dependencies(module):
    """Return the modules whose sources are in the stamp of a module."""
    found, waiting = set(), [module]
    while waiting:
        name = waiting.pop()
        path = sources._file_of(name)
        if path is not None and name not in found:
            found.add(name)
            waiting += sources._read(path)[1]
    return found


def test_every_kernel_has_a_stamp_of_all_modules_that_it_uses():
    """A plain function of numba has numba's stamp, that of its file; it may use nothing else."""
    rooms = set()
    for module, kernel in kernels():
        if not isinstance(kernel, Kernel):
            assert module == "lgmd_gym.kernels.bundle"
            continue
        rooms.add(module.split(".")[1])
        assert kernel._cache._cache_file._source_stamp == sources.source_stamp(module), module
        known = dependencies(module)
        for name in kernel.py_func.__code__.co_names:
            used = kernel.py_func.__globals__.get(name)
            home = getattr(getattr(used, "py_func", used), "__module__", None) or ""
            if isinstance(home, str) and home.startswith("lgmd_gym."):
                assert home in known, (module, name)
    assert {"camera", "envs", "neuron", "sensing"} <= rooms


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the package that may be edited."""
    folder = tmp_path_factory.mktemp("copy")
    ignored = shutil.ignore_patterns("__pycache__", "*.nb?", "*.zip", "*.pyc")
    shutil.copytree(ROOT, folder / "lgmd_gym", ignore=ignored)
    return folder


def run(folder, program, *arguments):
    found = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        cwd=folder,
        env={"PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(folder / "cache"), "LGMD_GYM_QUIET": "1"},
        check=True,
        capture_output=True,
        text=True,
        timeout=120,
    )
    return found.stdout.split()


@pytest.mark.parametrize(
    ("edited", "affected", "others"),
    [
        (
            "neuron/scalars.py",
            ["neuron.dsn", "neuron.lplc2", "neuron.lgmd.kernels"],
            ["envs.dynamics.contact"],
        ),
        ("kernels/simd.py", ["camera.render.raster", "neuron.lgmd.kernels"], []),
        ("sensing/kernels.py", ["sensing.kernels"], ["neuron.dsn"]),
        ("envs/dynamics/path.py", ["envs.dynamics.episode"], ["neuron.dsn"]),
        ("camera/render/light.py", ["camera.render.raster"], ["neuron.dsn"]),
    ],
)
def test_an_edit_changes_the_stamps_of_what_imports_it(copy, edited, affected, others):
    names = [f"lgmd_gym.{name}" for name in affected + others]
    before = run(copy, STAMPS, *names)
    path = copy / "lgmd_gym" / edited
    source = path.read_text("utf-8")
    path.write_text(source + "\nEDITED = 1\n", "utf-8")
    after = run(copy, STAMPS, *names)
    path.write_text(source, "utf-8")
    assert [one != other for one, other in zip(before, after, strict=True)] == [True] * len(affected) + [
        False
    ] * len(others)


def test_an_edit_of_a_called_file_recompiles_with_a_warm_cache(copy):
    first = run(copy, DSN)
    assert run(copy, DSN) == first
    path = copy / "lgmd_gym" / "neuron" / "scalars.py"
    source = path.read_text("utf-8")
    path.write_text(
        source.replace("row[FREQUENCY] = row[COUNT]", "row[FREQUENCY] = 2.0 * row[COUNT]"), "utf-8"
    )
    assert float(first[0]) > 0.0
    assert float(run(copy, DSN)[0]) == 2.0 * float(first[0])
