"""Is everything in place? Versions, kernels, codec, display and a short drive, each with the mend."""

import platform
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

import numpy as np

PACKAGE = "lgmd-gym"
SELF_TEST = 2.0  # [s] of wall time
SPEED = 8.0  # [m/s] at which the self-test approaches a standing car
REINSTALL = "in a clone of the repository and a fresh virtual environment: pip install -c constraints.txt ."
OK, NOTE, FAULT = "ok", "note", "fault"


@dataclass(frozen=True, slots=True)
class Finding:
    """What one check found.

    Attributes:
        check: What was looked at.
        state: "ok"; "note", something that not everybody needs is missing; or "fault".
        words: What was found.
        mend: What to do about it; empty if nothing is to be done.
    """

    check: str
    state: str
    words: str
    mend: str = ""


def examine() -> Iterator[Finding]:
    """Run every check, one after the other."""
    for name in CHECKS:
        yield from examine_one(name)


def examine_one(name: str) -> list[Finding]:
    """Run one check; if it raises, that is a fault of its own."""
    try:
        return CHECKS[name]()
    except Exception as error:
        words = f"{type(error).__name__}: {' '.join(str(error).split())}"
        return [Finding(name, FAULT, words, REINSTALL)]


def check_versions() -> list[Finding]:
    """Hold Python and every required package against what `pyproject.toml` asks for."""
    from packaging.requirements import Requirement

    found = [Finding("python", OK, f"{platform.python_version()} on {platform.platform()}")]
    wrong, fine = [], []
    for line in requires(PACKAGE) or []:
        need = Requirement(line)
        if need.marker is not None and not need.marker.evaluate({"extra": ""}):
            continue
        try:
            have = version(need.name)
        except PackageNotFoundError:
            wrong.append(f"{need.name} is missing")
            continue
        good = need.specifier.contains(have, prereleases=True)
        (fine if good else wrong).append(
            f"{need.name} {have}" + ("" if good else f", needs {need.specifier}")
        )
    if fine:
        found.append(Finding("packages", OK, ", ".join(fine)))
    if wrong:
        found.append(Finding("packages", FAULT, "; ".join(wrong), REINSTALL))
    return [*found, _training()]


def _training() -> Finding:
    """Say whether reinforcement learning is installed."""
    names = ("stable-baselines3", "torch")
    try:
        return Finding("training", OK, ", ".join(f"{name} {version(name)}" for name in names))
    except PackageNotFoundError as error:
        return Finding(
            "training",
            NOTE,
            f"{error.name} is not installed",
            'in a clone of the repository: pip install -c constraints.txt ".[train]"',
        )


def check_cache() -> list[Finding]:
    """See whether numba can keep compiled kernels, without which each process compiles for itself."""
    mend = "set NUMBA_CACHE_DIR to a folder that can be written to"
    try:
        from lgmd_gym.camera.render import raster
        from lgmd_gym.neuron import kernels
    except RuntimeError as error:  # numba's "no locator available"
        return [Finding("numba cache", FAULT, str(error), mend)]
    folders = {_cache_folder(module) for module in (kernels, raster)}
    found = []
    for folder in sorted(folders):
        try:
            Path(folder).mkdir(parents=True, exist_ok=True)
            with TemporaryFile(dir=folder):
                found.append(Finding("numba cache", OK, folder))
        except OSError as error:
            found.append(
                Finding("numba cache", FAULT, f"{folder} cannot be written to: {error.strerror}", mend)
            )
    return found


def _cache_folder(module: Any) -> str:
    """Return where numba keeps the compiled functions of a module."""
    kept = (getattr(item, "stats", None) for item in vars(module).values())
    folders = (getattr(stats, "cache_path", None) for stats in kept)
    return next(folder for folder in folders if folder)


def check_codec() -> list[Finding]:
    """Write a short H.264 video and read it back."""
    from imageio_ffmpeg import get_ffmpeg_exe, get_ffmpeg_version, read_frames

    from lgmd_gym.video import VideoWriter

    mend = "pip install --force-reinstall imageio-ffmpeg, or set IMAGEIO_FFMPEG_EXE to one with libx264"
    picture = np.full((64, 64, 3), 200, np.uint8)
    try:
        with TemporaryDirectory() as folder:
            with VideoWriter(Path(folder) / "test.mp4", 30.0) as writer:
                for _ in range(3):
                    writer.write(picture)
            reader = read_frames(str(writer.path))
            next(reader)
            pictures = [np.frombuffer(frame, np.uint8) for frame in reader]
    except (OSError, RuntimeError) as error:
        return [Finding("video", FAULT, " ".join(str(error).split())[:160], mend)]
    good = len(pictures) == 3 and abs(float(pictures[0].mean()) - 200.0) < 5.0
    words = f"ffmpeg {get_ffmpeg_version()} at {get_ffmpeg_exe()}"
    return [
        Finding("video", OK, words) if good else Finding("video", FAULT, f"{words} garbles pictures", mend)
    ]


def check_window() -> list[Finding]:
    """See whether `drive --live` could open a window."""
    from lgmd_gym.rendering.window import check_display

    try:
        return [Finding("display", OK, f"a window can be opened (SDL's driver {check_display()!r})")]
    except ValueError as error:
        words, _, mend = str(error).partition("; ")
        return [Finding("display", NOTE, words, mend)]


def check_drive() -> list[Finding]:
    """Play approaches for two seconds: the brake must hold, the same way each time."""
    start = time.perf_counter()
    hit, _ = _approach("no-brake")
    ready = time.perf_counter() - start
    first, frames = _approach("spike-threshold")
    start, steps, repeats = time.perf_counter(), 0, 0
    same = True
    while time.perf_counter() - start < SELF_TEST:
        again, frames = _approach("spike-threshold")
        same = same and again == first
        steps, repeats = steps + frames, repeats + 1
    rate = steps / (time.perf_counter() - start)
    mend = "run the tests (python -m pytest); if they fail too, please report it with this table"
    found = [
        Finding("kernels", OK, f"ready after {ready:.1f} s (compiled once, then kept in the numba cache)")
    ]
    if not hit[0] or first[0]:
        words = f"no-brake {_ending(hit)}, spike-threshold {_ending(first)}; expected contact and none"
        return [*found, Finding("self-test", FAULT, words, mend)]
    if not same:
        return [*found, Finding("self-test", FAULT, "one drive with one seed ended in two ways", mend)]
    words = f"{repeats} approaches, {_ending(first)}, {rate:,.0f} camera frames/s on one core"
    return [*found, Finding("self-test", OK, words)]


def _approach(name: str) -> tuple[tuple[bool, float], int]:
    """Play one approach and return (contact, free distance at the end), and the number of decisions."""
    import gymnasium as gym

    import lgmd_gym  # noqa: F401  (registers the ids)
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


def _ending(outcome: tuple[bool, float]) -> str:
    return "contact" if outcome[0] else f"stopped {outcome[1]:.2f} m short"


CHECKS: dict[str, Callable[[], list[Finding]]] = {
    "versions": check_versions,
    "numba cache": check_cache,
    "video": check_codec,
    "display": check_window,
    "self-test": check_drive,
}


def report(findings: Iterable[Finding], console: Any) -> int:
    """Print findings as they come, with the mends under them, and return the number of faults."""
    from rich.markup import escape

    colours = {OK: "green", NOTE: "yellow", FAULT: "red"}
    faults = 0
    for item in findings:
        head = f"[{colours[item.state]}]{item.state:5}[/] {item.check:11}"
        console.print(f"{head} {escape(item.words)}", soft_wrap=True, highlight=False)
        if item.mend:
            console.print(f"{'':17} [bold]→ {escape(item.mend)}[/]", soft_wrap=True, highlight=False)
        faults += item.state == FAULT
    return faults
