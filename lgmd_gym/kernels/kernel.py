# pyright: standard
# Not strict: numba states no types of its internals.
"""Functions that numba compiles in 40 % less time than with `numba.njit`, to the same arithmetic.

`numba.njit` makes machine code of every function, and a wrapper for calls from Python and another for calls
from C. Most functions here are called by other compiled functions only, as a part of their machine code. They
have none of the three until Python calls them.
"""

import gc
import itertools
import os
import secrets
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

import numba
from llvmlite.binding import Linkage
from numba.core import config, sigutils, types
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering

from lgmd_gym.aliases import Arguments
from lgmd_gym.kernels.cache_folder import use_temporary_folder
from lgmd_gym.kernels.compilation import lock_of_user, report_compilation
from lgmd_gym.kernels.sources import source_stamp


def _number_functions() -> None:
    """Make numba's numbers of functions unique across processes.

    numba counts functions from 1 in every process, and the linker identifies a function by its name, types
    and number. Two processes could cache different functions with the same identifier, such as the sum and
    the product of vectors, and a caller of both would be linked with only one of them.
    """
    FunctionIdentity._unique_ids = itertools.count(secrets.randbits(60))


_number_functions()
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_number_functions)

# Versions of numba with the internals that `Kernel` uses; with any other, `kernel` is `numba.njit`.
_KNOWN = (0, 62) <= numba.version_info.short <= (0, 68)


def kernel(
    function: Callable[..., Any] | None = None,
    *,
    exact: bool = False,
    inline: bool = False,
    arrays: bool = False,
) -> Any:
    """Compile a function at its first call, without the GIL and single-threaded; numba caches it on disk.

    A change of its file, or of any file of this package that it imports, invalidates the cache.

    Args:
        function: Function that numba can compile.
        exact: Whether the results equal those of the same arithmetic in Python to the bit; if not, the
            compiler may contract multiplications and additions, and ignore the sign of zero.
        inline: Whether the function becomes part of each caller. It serves short functions that are called
            for every edge or row: a call passes an array as eleven numbers.
        arrays: Whether the function may create arrays, assign one array to another, return an array or
            receive a `Bundle`. Without it, calls do not count references to arrays; the atomic counts took
            half of the time of a frame.
    """
    if function is None:
        return partial(kernel, exact=exact, inline=inline, arrays=arrays)
    report_compilation()
    options: Arguments = {
        "nogil": True,
        "no_cfunc_wrapper": True,
        "error_model": "numpy",
        "_nrt": arrays,
    }
    options["fastmath"] = False if exact else {"contract", "nsz"}
    if inline:
        options["forceinline"] = True
    if config.DISABLE_JIT or not _KNOWN:  # pyright: ignore[reportAttributeAccessIssue]
        compiled: Any = numba.njit(cache=True, **options)(function)
    else:
        compiled = Kernel(function, targetoptions={**options, "nopython": True}, pipeline_class=_Compiler)
        compiled.enable_caching()
    index: Any = getattr(getattr(compiled, "_cache", None), "_cache_file", None)
    if hasattr(index, "_source_stamp") and function.__module__.startswith("lgmd_gym."):
        index._source_stamp = source_stamp(function.__module__)
    return compiled


def is_cached(kernel: Any) -> bool:
    """Return whether this process or numba's cache has a compiled form of a kernel of the present source."""
    if kernel.signatures:
        return True
    file = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    try:
        return bool(file is not None and file._load_index())
    except (ImportError, AttributeError):  # of unpickling the types of an earlier version of this package
        return False


class Kernel(CPUDispatcher):
    """A function as `numba.njit` returns it, which is compiled for Python only if Python calls it.

    Its overloads of the kind that Python cannot call are named `inner`; `_insert` never sees them.
    """

    _depth = 0  # of compilations, each of which was started by its caller's

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._inner: set[tuple[types.Type, ...]] = set()

    def enable_caching(self) -> None:
        """Cache on disk."""
        try:
            self._cache = _Cache(self.py_func)
        except RuntimeError:  # no folder is writable
            with suppress(OSError):
                use_temporary_folder()
            self._cache = _Cache(self.py_func)

    def compile(self, sig: Any) -> Any:
        """Compile or load the function for the types `sig`; return the entry point."""
        with global_compiler_lock, _without_garbage_collection():
            args, _ = sigutils.normalize_signature(sig)
            # A constant argument would cause a compilation of its own.
            sig = args = tuple(types.unliteral(arg) for arg in args)
            if Kernel._depth == 0 and args in self._inner:
                self._inner.remove(args)
                del self.overloads[args]
            Kernel._depth += 1
            try:
                return super().compile(sig)
            finally:
                Kernel._depth -= 1

    def compile_inner(self, *args: Any) -> None:
        """Compile or load the function for compiled callers with arguments such as these."""
        Kernel._depth += 1
        try:
            self.compile(tuple(map(self.typeof_pyval, args)))
        finally:
            Kernel._depth -= 1

    def add_overload(self, cres: CompileResult) -> None:
        """Store a compiled or loaded overload."""
        if _is_inner():
            args = tuple(cres.signature.args)
            self._inner.add(args)
            self.overloads[args] = cres
            return
        # The addresses of the environments of called functions, as numba does after loading from the cache.
        for environment in cres._find_referenced_environments():
            cres.codegen.set_env(environment.env_name, environment)
        super().add_overload(cres)


def _is_inner() -> bool:
    """Return whether the function is compiled for a caller that is compiled."""
    return Kernel._depth > 1


@contextmanager
def _without_garbage_collection() -> Generator[None, None, None]:
    """Leave the collector off: it searches the growing structures of the compiler again and again."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


@contextmanager
def _one_process() -> Generator[None, None, None]:
    """Keep the other processes of this user out of the block, where the system has such locks."""
    lock = None
    with suppress(OSError):
        lock = lock_of_user("cache", wait=True)
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


class _Cache(FunctionCache):
    """Cache with separate entries for the two kinds of overloads."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return *super()._index_key(sig, codegen), _is_inner()

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store an overload; one process at a time, because numba reads, changes and writes an index."""
        with _one_process():
            super().save_overload(sig, data)

    def load_overload(self, sig: object, target_context: object) -> CompileResult | None:
        """Return a stored overload; None, after clearing the cache, if it names modules that were renamed."""
        try:
            return super().load_overload(sig, target_context)
        except (ImportError, AttributeError):  # of unpickling the types of an earlier version of this package
            self.flush()
            return None


class _OuterLibrary(JITCodeLibrary):
    """LLVM module of a function that Python calls, with all functions that it calls.

    They are private to it, except those with fixed names, such as the destructors of lists: numba shares them
    between modules, and functions compiled for threads crash otherwise. The optimizer then makes a function
    that is called at one place a part of its caller, and removes arguments that nothing reads: a call passes
    an array as eleven numbers.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr and function.name.startswith("_Z"):
                function.linkage = Linkage.internal
        super()._optimize_final_module()


class _InnerLibrary(JITCodeLibrary):
    """LLVM module of a function without machine code, for the modules of the functions that call it."""

    def _optimize_final_module(self) -> None:
        """Leave the module as it is: that of the function that Python calls is optimized as a whole."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode()


@register_pass(mutates_CFG=True, analysis_only=False)
class _Lowering(NativeLowering):
    """Lowering of an inner function without wrapper and machine code, and of others as numba does."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> Any:
        if not _is_inner():
            state.library = _OuterLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
            state.library.enable_object_caching()
            return super().run_pass(state)
        state.flags.no_compile = state.flags.no_cpython_wrapper = True
        state.library = _InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        super().run_pass(state)
        state.library.finalize()
        entry_point = object()
        state.targetctx.insert_user_function(entry_point, state.cr.fndesc, [state.library])
        state.cr = state.cr._replace(cfunc=entry_point)
        return True


class _Compiler(CompilerBase):
    """numba's compiler with `_Lowering`."""

    def define_pipelines(self) -> list[PassManager]:
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.passes = [
            (_Lowering, name) if each is NativeLowering else (each, name) for each, name in manager.passes
        ]
        manager.finalize()
        return [manager]
