"""Progress of numba's compilation on stderr."""

import importlib
import io
import subprocess
import sys
from types import SimpleNamespace

import numba
import pytest

from lgmd_gym.benchmark import RunConfig, runner
from lgmd_gym.benchmark.runner import Run
from lgmd_gym.engine import first_use
from lgmd_gym.kernels import compilation
from lgmd_gym.kernels.kernel import is_cached
from lgmd_gym.processes.pool import Executor


def kernel():
    """Stand for a function that is compiled."""


kernel.__module__ = "lgmd_gym.camera.render"
EVENT = SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=kernel)})
OF_NUMBA = SimpleNamespace(data={"dispatcher": SimpleNamespace(py_func=max)})


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def reporter(monkeypatch):
    monkeypatch.delenv(compilation.VARIABLE, raising=False)
    now = [100.0]
    reporter = compilation.CompilationReporter()
    reporter._clock = lambda: now[0]

    def compile_for(*seconds):
        """Compile a caller with called functions, each for some seconds."""
        reporter.on_start(EVENT)
        for each in seconds:
            reporter.on_start(OF_NUMBA)
            now[0] += each
            reporter.on_end(EVENT)
        reporter.on_end(EVENT)

    reporter.compile_for, reporter.now = compile_for, now
    return reporter


def test_a_short_compilation_is_silent(reporter, capsys):
    reporter.compile_for(0.9, 0.9, 0.1)
    assert capsys.readouterr().err == ""


def test_a_long_compilation_prints_what_it_does(reporter, capsys):
    reporter.compile_for(*[1.0] * 25)
    first, *others = capsys.readouterr().err.splitlines()
    assert first == f"lgmd-gym: {compilation.START}"
    assert others == [
        "lgmd-gym: compiling kernels for their first use: 12 functions in 12 s",
        "lgmd-gym: compiling kernels for their first use: 22 functions in 22 s",
    ]


def test_time_adds_up_over_kernels_but_not_over_pauses(reporter, capsys):
    reporter.compile_for(1.5)
    reporter.now[0] += compilation.PAUSE_S + 1.0
    reporter.compile_for(1.5)
    assert capsys.readouterr().err == ""
    reporter.compile_for(1.0, 1.0)
    assert compilation.START in capsys.readouterr().err


@pytest.mark.parametrize(("expected", "share"), [(48, "25 %"), (7, "99 %")])
def test_a_known_number_of_functions_gives_a_percentage(reporter, monkeypatch, capsys, expected, share):
    monkeypatch.setattr(compilation, "_reporter", reporter)
    with compilation.expected_functions(expected):
        reporter.compile_for(*[1.0] * 15)
    assert f"for their first use: {share} in 12 s\n" in capsys.readouterr().err
    assert reporter.expected == 0


def test_the_variable_switches_it_off(reporter, monkeypatch, capsys):
    monkeypatch.setenv(compilation.VARIABLE, "1")
    reporter.compile_for(*[1.0] * 25)
    assert capsys.readouterr().err == ""


def test_a_terminal_has_one_line_that_is_erased(reporter, monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(sys, "__stderr__", terminal)
    reporter.compile_for(*[1.0] * 5)
    first, *others, last, rest = terminal.getvalue().split("\r")
    assert first.endswith(compilation.START)
    assert len(others) == 2
    assert (last, rest) == ("\x1b[2K", "")
    assert "\n" not in terminal.getvalue()


def test_of_two_workers_one_reports(reporter, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setattr(compilation, "current_process", lambda: SimpleNamespace(name="LokyProcess-1"))
    assert compilation._is_first_worker()
    held = compilation._lock  # open until the end of the first worker
    reporter.compile_for(*[1.0] * 5)
    assert capsys.readouterr().err == ""
    compilation.os.close(held)


def test_numba_is_observed(monkeypatch, capsys):
    monkeypatch.delenv(compilation.VARIABLE, raising=False)
    monkeypatch.setattr(compilation, "DELAY_S", 0.0)
    monkeypatch.setattr(compilation, "_reporter", None)
    compilation.report_compilation()
    observer = compilation._reporter
    compilation.report_compilation()
    assert compilation._reporter is observer
    try:
        assert numba.njit(lambda x: x + 1)(1) == 2
        assert observer.count >= 1
    finally:
        compilation.event.unregister("numba:compile", observer)
    assert compilation.START in capsys.readouterr().err


def test_kernels_are_compiled_before_the_workers_start(monkeypatch, tmp_path):
    events = []
    monkeypatch.setattr(runner, "compile_kernels", lambda: events.append("compiled"))
    config = RunConfig(suite="quick", agents=("no-brake",), seeds=1)
    run = Run.new(config, tmp_path / "run", Executor(2))
    run.plan.play = lambda run_tasks, rows: iter([events.append("played")][:0])
    run.play()
    assert events == ["compiled", "played"]


def test_a_kernel_that_was_compiled_is_cached(tmp_path, monkeypatch):
    (tmp_path / "one_kernel.py").write_text(
        "import numba\n@numba.njit(cache=True)\ndef twice(x): return 2 * x\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    twice = importlib.import_module("one_kernel").twice
    assert not is_cached(twice)
    twice(1)
    assert is_cached(twice)


def test_cached_kernels_start_no_process(monkeypatch):
    monkeypatch.setattr(first_use, "is_cached", lambda kernel: True)
    monkeypatch.setattr(first_use.subprocess, "Popen", lambda *_, **__: pytest.fail("started a process"))
    first_use.compile_kernels()


def test_nothing_is_compiled_with_numba_disabled(monkeypatch):
    monkeypatch.setattr(first_use.config, "DISABLE_JIT", 1)
    monkeypatch.setattr(first_use, "is_cached", lambda kernel: kernel.signatures)  # a plain function has none
    monkeypatch.setattr(first_use.subprocess, "Popen", lambda *_, **__: pytest.fail("started a process"))
    monkeypatch.setattr(first_use, "advance", lambda: None)
    first_use.compile_kernels()


@pytest.mark.slow
def test_a_second_process_compiles_what_is_not_camera(monkeypatch):
    started, popen, uses = [], subprocess.Popen, []

    def start(*arguments, **options):
        started.append(popen(*arguments, **options))
        return started[0]

    monkeypatch.setattr(first_use.subprocess, "Popen", start)
    monkeypatch.setattr(first_use, "is_cached", lambda kernel: False)
    for name in ("_draw_camera", "_step_environment"):
        monkeypatch.setattr(first_use, name, lambda *_, name=name: uses.append((name, started[0].poll())))
    first_use.compile_kernels()
    assert uses == [("_draw_camera", None), ("_step_environment", 0)]  # at once, then after its end


@pytest.mark.parametrize("executable", ["", None, "/no/such/python"])
def test_without_a_second_process_the_first_one_compiles_all(monkeypatch, executable):
    used = []
    monkeypatch.setattr(first_use, "is_cached", lambda kernel: False)
    monkeypatch.setattr(sys, "executable", executable)
    for name in ("_draw_camera", "_step_environment"):
        monkeypatch.setattr(first_use, name, lambda *_, name=name: used.append(name))
    first_use.compile_kernels()
    assert used == ["_draw_camera", "_step_environment"]


def test_an_index_that_names_a_removed_module_is_no_cache():
    def load_index():
        raise ModuleNotFoundError("No module named 'lgmd_gym.moved'")

    file = SimpleNamespace(_load_index=load_index)
    assert not is_cached(SimpleNamespace(signatures=[], _cache=SimpleNamespace(_cache_file=file)))
