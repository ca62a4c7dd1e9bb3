"""The `doctor` command: check versions, kernel cache, video codec, display and a short simulation."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from types import ModuleType

from rich.console import Console
from rich.text import Text

from lgmd_gym.cli.console import make_console

PACKAGE = "lgmd-gym"
SELF_TEST_S = 2.0  # Wall time of the self-test [s].
SPEED = 8.0  # Ego speed of the self-test's approach to a standing car [m/s].
REINSTALL = "in a clone of the repository and a fresh virtual environment: pip install -c constraints.txt ."
INDENT = 18  # columns before a message
OK, NOTE, FAULT = "ok", "note", "fault"


@dataclass(frozen=True, kw_only=True)
class Doctor:
    """Check package versions, numba's cache, the video codec and the display, and simulate for two seconds.

    The exit code is 1 if a check finds a fault; the output suggests a fix.
    """


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one check."""

    check: str  # name of the check
    state: str  # "ok"; "note" if something optional is missing; or "fault"
    message: str  # description of the result
    fix: str = ""  # suggested fix; empty if none is needed


def run(options: Doctor) -> int:
    """Run all checks and print the findings; return 1 for any fault, else 0."""
    return int(print_findings(run_checks(), make_console()) > 0)


def run_checks() -> Iterator[Finding]:
    """Run every check in turn and yield the findings."""
    for name in CHECKS:
        yield from run_check(name)


def run_check(name: str) -> list[Finding]:
    """Run one check; an exception becomes a fault."""
    try:
        return CHECKS[name]()
    except Exception as error:
        message = f"{type(error).__name__}: {' '.join(str(error).split())}"
        return [Finding(name, FAULT, message, REINSTALL)]


def print_findings(findings: Iterable[Finding], console: Console) -> int:
    """Print findings with their fixes and return the number of faults."""
    colours = {OK: "green", NOTE: "yellow", FAULT: "red"}
    faults = 0
    for item in findings:
        head = (f"{item.state:5}", colours[item.state])
        line = Text.assemble(head, f" {item.check:11} {_indented(item.message, console)}")
        console.print(line, soft_wrap=True, highlight=False)
        if item.fix:
            fix = _indented(f"→ {item.fix}", console)
            console.print(Text(f"{'':{INDENT}}{fix}", "bold"), soft_wrap=True, highlight=False)
        faults += item.state == FAULT
    return faults


def _indented(text: str, console: Console) -> str:
    """Return a text in lines of the console's width after `INDENT` columns; paths are not broken."""
    lines = wrap(text, console.width - INDENT, break_long_words=False, break_on_hyphens=False)
    return f"\n{'':{INDENT}}".join(lines)


def check_versions() -> list[Finding]:
    """Compare Python and the installed packages with the requirements in `pyproject.toml`."""
    import platform
    from importlib.metadata import PackageNotFoundError, requires, version

    from packaging.requirements import Requirement

    found = [Finding("python", OK, f"{platform.python_version()} on {platform.platform()}")]
    unmet: list[str] = []
    met: list[str] = []
    for line in requires(PACKAGE) or []:
        requirement = Requirement(line)
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            installed = version(requirement.name)
        except PackageNotFoundError:
            unmet.append(f"{requirement.name} is missing")
            continue
        if requirement.specifier.contains(installed, prereleases=True):
            met.append(f"{requirement.name} {installed}")
        else:
            unmet.append(f"{requirement.name} {installed}, requires {requirement.specifier}")
    if met:
        found.append(Finding("packages", OK, ", ".join(met)))
    if unmet:
        found.append(Finding("packages", FAULT, "; ".join(unmet), REINSTALL))
    return [*found, _check_training()]


def _check_training() -> Finding:
    """Report whether the packages of the extra "train" are installed."""
    from importlib.metadata import PackageNotFoundError, version

    from lgmd_gym.processes.extras import install_command

    names = ("stable-baselines3", "torch")
    try:
        return Finding("training", OK, ", ".join(f"{name} {version(name)}" for name in names))
    except PackageNotFoundError as error:
        return Finding("training", NOTE, f"{error.name} is not installed", install_command("train"))


def check_cache() -> list[Finding]:
    """Check that numba can store compiled kernels; otherwise every process compiles them again."""
    from tempfile import TemporaryFile

    from numba.core import config

    if config.DISABLE_JIT:  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]
        return [Finding("numba", FAULT, "NUMBA_DISABLE_JIT: nothing is compiled", "unset NUMBA_DISABLE_JIT")]
    fix = "set NUMBA_CACHE_DIR to a writable folder"
    try:
        from lgmd_gym.camera.render import raster
        from lgmd_gym.neuron.lgmd import kernels
    except RuntimeError as error:  # numba: "no locator available"
        return [Finding("numba cache", FAULT, str(error), fix)]
    found: list[Finding] = []
    for folder in sorted({_cache_folder(module) for module in (kernels, raster)}):
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
            with TemporaryFile(dir=folder):
                found.append(Finding("numba cache", OK, folder))
        except OSError as error:
            found.append(Finding("numba cache", FAULT, f"{folder} is not writable: {error.strerror}", fix))
    return found


def _cache_folder(module: ModuleType) -> str:
    """Return the folder in which numba caches the compiled functions of a module."""
    stats = (getattr(item, "stats", None) for item in vars(module).values())
    folders = (getattr(item, "cache_path", None) for item in stats)
    return next(folder for folder in folders if folder)


def check_codec() -> list[Finding]:
    """Write a short H.264 video and read it back."""
    from tempfile import TemporaryDirectory

    import av
    import numpy as np

    from lgmd_gym.clips import VideoReader, VideoWriter

    fix = "pip install --force-reinstall av"
    picture = np.full((64, 64, 3), 200, np.uint8)
    try:
        with TemporaryDirectory() as folder:
            with VideoWriter(Path(folder) / "test.mp4", 30.0) as writer:
                for _ in range(3):
                    writer.write(picture)
            pictures = list(VideoReader(writer.path))
    except (OSError, RuntimeError, ValueError) as error:
        return [Finding("video", FAULT, " ".join(str(error).split())[:160], fix)]
    message = f"PyAV {av.__version__} with ffmpeg {av.ffmpeg_version_info}"
    if len(pictures) == 3 and abs(float(pictures[0].mean()) - 200.0) < 5.0:
        return [Finding("video", OK, message)]
    return [Finding("video", FAULT, f"{message} does not reproduce the written pictures", fix)]


def check_window() -> list[Finding]:
    """Check that `drive --live` can open a window."""
    from lgmd_gym.rendering.window import check_display

    try:
        return [Finding("display", OK, f"a window can be opened (SDL driver {check_display()!r})")]
    except ValueError as error:
        message, _, fix = str(error).partition("; ")
        return [Finding("display", NOTE, message, fix)]


def check_simulation() -> list[Finding]:
    """Repeat one approach for two seconds: the rule must stop the car, with the same result every time."""
    from lgmd_gym.engine.first_use import compile_kernels

    start = time.perf_counter()
    compile_kernels()
    unbraked, _ = _run_approach("no-brake")
    compiled = f"ready after {time.perf_counter() - start:.1f} s (compiled once, then cached by numba)"
    braked, steps = _run_approach("spike-threshold")
    start, total, repeats, same = time.perf_counter(), 0, 0, True
    while time.perf_counter() - start < SELF_TEST_S:
        again, steps = _run_approach("spike-threshold")
        same = same and again == braked
        total, repeats = total + steps, repeats + 1
    rate = total / (time.perf_counter() - start)
    fix = "run the tests (python -m pytest); if they fail too, please report it with this output"
    found = [Finding("kernels", OK, compiled)]
    if not unbraked[0] or braked[0]:
        message = (
            f"expected contact with no-brake and none with spike-threshold, got {_describe(unbraked)} "
            f"and {_describe(braked)}"
        )
        return [*found, Finding("self-test", FAULT, message, fix)]
    if not same:
        return [*found, Finding("self-test", FAULT, "one seed gave two different results", fix)]
    message = f"{repeats} approaches, {_describe(braked)}, {rate:,.0f} camera frames/s on one core"
    return [*found, Finding("self-test", OK, message)]


def _run_approach(name: str) -> tuple[tuple[bool, float], int]:
    """Run one approach; return (contact, final gap [m]) and the number of decisions."""
    import gymnasium as gym

    import lgmd_gym  # noqa: F401  (registers the ids)  # pyright: ignore[reportUnusedImport]
    from lgmd_gym.agents import make_agent

    agent = make_agent(name)
    env = gym.make("LGMD/CCRs-v0", ego_speed=SPEED)
    observation, info = env.reset(seed=0)
    agent.reset(0)
    done, steps = False, 0
    while not done:
        observation, _, terminated, truncated, info = env.step(agent.act(observation, info))
        done, steps = terminated or truncated, steps + 1
    env.close()
    return (bool(info["collision"]), float(info["gap"])), steps


def _describe(result: tuple[bool, float]) -> str:
    return "contact" if result[0] else f"stopped {result[1]:.2f} m before the target"


CHECKS: dict[str, Callable[[], list[Finding]]] = {
    "versions": check_versions,
    "numba cache": check_cache,
    "video": check_codec,
    "display": check_window,
    "self-test": check_simulation,
}
