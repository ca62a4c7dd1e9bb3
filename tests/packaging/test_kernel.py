"""Functions that are compiled without machine code and wrapper until Python calls them."""

import gc
import importlib
import os
import pickle
import subprocess
import sys

import numba
import pytest
from llvmlite.binding import Linkage
from numba.core.bytecode import FunctionIdentity

SOURCE = """
from lgmd_gym.kernels import kernel

@kernel(exact=True, arrays=True)
def square(x):
    if x < 0:
        raise ValueError("negative")
    return x * x

@kernel(exact=True, arrays=True)
def square_sum(x, y):
    return square(x) + square(y)

@kernel(exact=True, arrays=True)
def tripled(x):
    return square_sum(x, x) + square(x)

@kernel(exact=True, arrays=True)
def fibonacci(n):
    return n if n < 2 else fibonacci(n - 1) + fibonacci(n - 2)

@kernel(exact=True, arrays=True)
def fibonacci_sum(n):
    return fibonacci(n) + 1

@kernel(exact=True, arrays=True)
def lists(n):
    return [[i] for i in range(n)]
"""
CALLS = "import squares as s; print(s.{}, len(s.square_sum.stats.cache_hits), len(s.square.stats.cache_hits))"

kernel_module = importlib.import_module("lgmd_gym.kernels.kernel")
pytestmark = pytest.mark.skipif(not kernel_module._KNOWN, reason="numba.njit with this version of numba")


@pytest.fixture
def squares(tmp_path, monkeypatch):
    """A module with three kernels, new in this process."""
    (tmp_path / "squares.py").write_text(SOURCE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "squares", raising=False)
    return importlib.import_module("squares")


def has_machine_code(kernel):
    """Return whether each overload of a kernel has a wrapper for Python and a compiled object."""
    return [
        cres.fndesc.llvm_cpython_wrapper_name in {f.name for f in cres.library.get_defined_functions()}
        and bool(getattr(cres.library, "_compiled_object", None))
        for cres in kernel.overloads.values()
    ]


def test_only_the_function_that_python_calls_has_machine_code(squares):
    assert squares.tripled(3) == 27
    assert [has_machine_code(each) for each in (squares.tripled, squares.square_sum, squares.square)] == [
        [True], [False], [False],
    ]  # fmt: skip
    assert squares.square_sum(2, 3) == 13
    assert has_machine_code(squares.square_sum) == [True]
    assert has_machine_code(squares.square) == [False]
    assert squares.square(4) == 16
    assert squares.square(1.5) == 2.25
    assert has_machine_code(squares.square) == [True, True]
    assert squares.tripled(2) == 12


def test_called_functions_are_private_to_the_function_that_python_calls(squares):
    """The optimizer can then make them a part of it; a function that calls itself twice remains one."""
    assert squares.fibonacci_sum(10) == 56
    (cres,) = squares.fibonacci_sum.overloads.values()
    linkages = {each.name: each.linkage for each in cres.library.get_defined_functions()}
    public = {name for name, linkage in linkages.items() if linkage != Linkage.internal}
    assert public == {cres.fndesc.llvm_func_name, cres.fndesc.llvm_cpython_wrapper_name}
    assert any("fibonacci" in name for name in linkages.keys() - public)


def test_destructors_of_lists_stay_public(squares):
    """Functions compiled for threads crash otherwise."""
    assert squares.lists(2) == [[0], [1]]
    (cres,) = squares.lists.overloads.values()
    destructors = [each for each in cres.library.get_defined_functions() if each.name.startswith(".dtor.")]
    assert destructors
    assert all(each.linkage == Linkage.linkonce_odr for each in destructors)


def test_exceptions_of_a_called_function_reach_python(squares):
    for _ in range(2):
        with pytest.raises(ValueError, match="negative"):
            squares.tripled(-1)


def test_another_process_loads_both_kinds_from_the_cache(squares, tmp_path):
    squares.tripled(3)
    squares.square_sum(3, 3)

    def call(expression):
        result = subprocess.run(
            [sys.executable, "-c", CALLS.format(expression)], cwd=tmp_path, capture_output=True, text=True
        )
        assert result.returncode == 0, result.stderr
        return [int(word) for word in result.stdout.split()]

    assert call("tripled(3)") == [27, 0, 0]
    assert call("square_sum(3, 3)") == [18, 1, 0]
    assert call("square(3)") == [9, 0, 0]  # was compiled for its callers only
    assert call("square(3)") == [9, 0, 1]


@pytest.mark.parametrize("collecting", [True, False])
def test_garbage_collection_is_as_before(squares, collecting):
    (gc.enable if collecting else gc.disable)()
    try:
        squares.square(1)
        assert gc.isenabled() is collecting
        with pytest.raises(Exception, match="No implementation"):
            squares.square("text")
        assert gc.isenabled() is collecting
    finally:
        gc.enable()


def test_an_unknown_version_of_numba_compiles_as_usual(squares, monkeypatch):
    monkeypatch.setattr(kernel_module, "_KNOWN", False)
    usual = kernel_module.kernel(squares.square.py_func)
    assert not isinstance(usual, kernel_module.Kernel)
    assert usual(3) == squares.square(3) == 9


def test_a_cache_of_an_earlier_version_with_renamed_modules_is_replaced(squares, tmp_path):
    """The index of such a cache cannot be unpickled, because the types in it name modules that are gone."""
    assert squares.tripled(3) == 27
    index = next(tmp_path.glob("__pycache__/squares.tripled*.nbi"))
    index.write_bytes(pickle.dumps(numba.__version__) + b"cno.such.module\nName\n.")
    run = subprocess.run(
        [sys.executable, "-c", CALLS.format("tripled(3)")],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert run.stdout.startswith("27 ")


VECTORS = """
import sys
import numpy as np
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import load, store

@kernel(exact=True, arrays=True)
def add(a, b, out):
    store(out, 0, load(a, 0) + load(b, 0))

@kernel(exact=True, arrays=True)
def multiply(a, b, out):
    store(out, 0, load(a, 0) * load(b, 0))

@kernel(exact=True, arrays=True)
def both(a, b, out, product):
    add(a, b, out)
    multiply(a, b, product)

a, b, out, product = (np.full(16, value, np.float32) for value in (2, 3, 0, 0))
if __name__ == "__main__":
    import vectors
    if sys.argv[1] == "both":
        vectors.both(a, b, out, product)
        print(out[0], product[0], len(vectors.add.stats.cache_hits), len(vectors.multiply.stats.cache_hits))
    else:
        getattr(vectors, sys.argv[1]).compile_inner(a, b, out)
"""


def test_functions_that_two_processes_compiled_are_linked_by_their_own_names(tmp_path):
    """Each process compiles one operator of vectors first; both have the same Python names and types."""
    (tmp_path / "vectors.py").write_text(VECTORS)
    for name in ("add", "multiply", "both"):
        run = subprocess.run(
            [sys.executable, "vectors.py", name], cwd=tmp_path, capture_output=True, text=True, check=True
        )
    assert run.stdout == "5.0 6.0 1 1\n"


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no forks")
def test_a_forked_process_numbers_functions_anew():
    before = next(FunctionIdentity._unique_ids)
    reading, writing = os.pipe()
    if (child := os.fork()) == 0:
        os.write(writing, str(next(FunctionIdentity._unique_ids)).encode())
        os._exit(0)
    os.waitpid(child, 0)
    number = int(os.read(reading, 100))
    os.close(reading)
    os.close(writing)
    assert abs(number - before) > 1_000_000
