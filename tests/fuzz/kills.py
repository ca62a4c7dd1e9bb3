"""Long commands that are stopped at random moments: `python tests/fuzz/kills.py --seconds 600`.

A case starts one command, and sends SIGTERM, SIGKILL or SIGINT to it, SIGINT also to its workers, as a
terminal does. It continues the command and stops it several times. No process and no shared memory may
remain, and no traceback. The command must then be able to resume or to run again, with the results of an
undisturbed command.
"""

import argparse
import functools
import os
import shutil
import signal
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1])]

from support import processes as kills
from support.clips import make_test_clip
from support.fuzz import run_cases
from support.recordings import RECORDED_YAML
from support.runs import read_rows, sorted_rows

STROKES = 4  # of a command, each followed by its continuation
RESULTS = ("out.png", "best.toml")  # complete if they exist
FIRST_S = 0.3  # [s] after which the command handles signals; before, Python itself starts
FILES = {
    "tiny.toml": 'name = "tiny"\n[[cases]]\nfamily = "CCRs"\nspeeds_kmh = [10, 20, 30]\n'
    '[[cases]]\nfamily = "EmptyRoad"\nspeeds_kmh = [30]\n',
    "traffic.toml": 'suite = "traffic"\nkinds = ["merge", "two-way"]\nseeds = 2\nagents = ["no-brake"]\n',
    "recorded.yml": RECORDED_YAML.replace("n_timesteps: 6", "n_timesteps: 40"),
    "ppo.yml": """
default:
  env_wrapper:
    - lgmd_gym.training.PolicyWrapper: {history: 2, repeat: 4}
  n_envs: 2
  n_timesteps: 192
  n_steps: 16
  batch_size: 16
  policy_kwargs: {net_arch: [8]}
""",
}


class Stroke(NamedTuple):
    """A signal, whether it goes to the workers, too, and its moment as a part of the duration."""

    number: signal.Signals
    to_all: bool
    part: float


class Command(NamedTuple):
    """A command, and how its results are checked.

    Attributes:
        arguments: The command line; it writes to `out`.
        repeat: The command line that continues after `out` has been made.
        results: Function of the folder that returns what must equal the results of an undisturbed command.
    """

    arguments: str
    repeat: str | None
    results: Callable[[Path], object]


def rows_of(folder):
    """Return the rows of a run and its summary."""
    return sorted_rows(read_rows(folder / "out")), (folder / "out" / "summary.csv").read_text()


def run_of(folder):
    """Return the rows of a run, its summary, and the names of its other outputs."""
    return *rows_of(folder), names_of(folder)


def names_of(folder):
    """Return the names of the files in `out`."""
    return sorted(str(path.relative_to(folder)) for path in (folder / "out").rglob("*"))


def traces_of(folder):
    """Return the names of the files in `out`, and the contents of the tables."""
    tables = sorted((folder / "out").rglob("*.csv"))
    return names_of(folder), [path.read_text() for path in tables]


def bytes_of(folder):
    """Return the bytes of the figure."""
    return (folder / "out.png").read_bytes()


def policy_of(folder):
    """Return the weights of a policy."""
    from stable_baselines3 import PPO

    weights = PPO.load(folder / "out" / "policy.zip", device="cpu").policy.state_dict()
    return {name: value.tolist() for name, value in weights.items()}


def shapes_of(folder):
    """Return the shapes of a policy's weights; the environments of a resumed training start anew."""
    evaluations = np.load(folder / "out" / "best" / "evaluations.npz")["timesteps"].tolist()
    assert evaluations == sorted(set(evaluations)), evaluations
    return {name: np.shape(value) for name, value in policy_of(folder).items()}, evaluations


def parameters_of(folder):
    """Return whether the result is readable; a repeated search has more trials and may find another one."""
    return isinstance(tomllib.loads((folder / "best.toml").read_text()), dict)


BENCH = "bench --suite tiny.toml --agents spike-threshold ttc-oracle"
RECORDED = "train --algo time-to-brake --camera fovea --jobs 2 --eval-episodes 8 --hyperparams recorded.yml"
PPO = "train --algo ppo --camera fovea --eval-freq 64 --eval-episodes 2 --hyperparams ppo.yml"
TUNE = "tune --agent danger-zone --trials 3 --levels 8 --seeds 0 --study out --best best.toml"
COMMANDS = {
    "bench": Command(
        f"{BENCH} --seeds 8 --no-plots --no-report --out out",
        "bench --resume out --no-plots --no-report", rows_of,
    ),
    "outputs": Command(f"{BENCH} --seeds 1 --out out", "bench --resume out", run_of),
    "traffic": Command("bench --config traffic.toml --out out", "bench --resume out", rows_of),
    "ppo": Command(f"{PPO} --out out", "train --resume out", shapes_of),
    "recorded": Command(f"{RECORDED} --out out", "train --resume out", policy_of),
    "tune": Command(TUNE, TUNE, parameters_of),
    "video": Command("video clip.mp4 --configs paper t_sf-60 --overlay --out out", None, traces_of),
    "gallery": Command("gallery --families CCRs --seeds 1 --out out", None, names_of),
    "compare": Command("compare run --out out.png", None, bytes_of),
    "paper": Command("paper --out out", None, traces_of),
    "stimuli": Command("stimuli looming-* --out out", None, names_of),
}  # fmt: skip


@functools.cache
def inputs():
    """Return a folder with the files that the commands read."""
    folder = Path(tempfile.mkdtemp(prefix="kills-"))
    for name, text in FILES.items():
        (folder / name).write_text(text)
    make_test_clip(folder / "clip.mp4", source="testsrc2=size=160x120:rate=30:duration=4")
    complete(f"{BENCH} --seeds 8 --out run", folder)
    return folder


@functools.cache
def undisturbed(name):
    """Return the results of an undisturbed command, and its duration [s]."""
    folder = new_folder(name)
    started = time.monotonic()
    complete(COMMANDS[name].arguments, folder)
    return COMMANDS[name].results(folder), time.monotonic() - started


def new_folder(name):
    """Return a copy of the inputs."""
    folder = Path(tempfile.mkdtemp(prefix=f"kills-{name}-"))
    shutil.copytree(inputs(), folder, dirs_exist_ok=True)
    return folder


def complete(line, folder):
    """Run a command to its end, which must be without errors."""
    process = kills.start(line.split(), "complete", cwd=folder)
    _, errors = process.communicate(timeout=1200)
    assert process.returncode == 0, (line, process.returncode, errors)


def next_line(name, folder):
    """Return the command line that starts or continues a command; None if it is complete."""
    command = COMMANDS[name]
    if any((folder / path).exists() for path in RESULTS):
        return None
    return command.repeat if (folder / "out").exists() else command.arguments


def stop(line, folder, stroke, duration):
    """Stop a command at a moment, and check its end; return whether the signal came before it."""
    tag, temporary = f"{os.getpid()}-{folder.name}-{time.monotonic_ns()}", folder / "tmp"
    temporary.mkdir(exist_ok=True)
    process = kills.start(line.split(), tag, cwd=folder, env={"TMPDIR": str(temporary)})
    time.sleep(FIRST_S + stroke.part * (duration - FIRST_S))
    owners, running = {process.pid, *kills.processes(tag)}, process.poll() is None
    if running:
        (os.killpg if stroke.to_all else os.kill)(process.pid, stroke.number)
    _, errors = process.communicate(timeout=1200)
    # Python restores the default handler of SIGTERM at the very end.
    expected = (kills.CODES[stroke.number], -stroke.number) if running else (0,)
    assert process.returncode in expected, (process.returncode, errors)
    assert "Traceback" not in errors, errors
    kills.wait_until_gone(tag, owners)
    killed = stroke.number == signal.SIGKILL
    assert killed or not (left := os.listdir(temporary)), f"temporary files: {left}"
    shutil.rmtree(temporary)
    return running


def draw_case(names, rng):
    """Return a description and the check of one command that is stopped several times."""
    name, strokes = str(rng.choice(names)), []
    for _ in range(STROKES):
        number, to_all, part = signal.Signals(rng.choice(list(kills.CODES))), rng.integers(2), rng.uniform()
        strokes.append(Stroke(number, number == signal.SIGINT and bool(to_all), part))

    def check():
        results, duration = undisturbed(name)
        folder, stopped = new_folder(name), []
        for stroke in strokes:
            if (line := next_line(name, folder)) and stop(line, folder, stroke, duration):
                stopped.append(f"{stroke.number.name}{' to all' * stroke.to_all} at {stroke.part:.2f}")
        if line := next_line(name, folder):
            complete(line, folder)
        assert COMMANDS[name].results(folder) == results
        left = [str(path) for path in folder.rglob("*.part")]
        assert not left, left
        print(f"{name} ({duration:.1f} s), {len(stopped)} stops: {', '.join(stopped)}", flush=True)
        shutil.rmtree(folder)

    return f"{name}, {strokes}", check


if __name__ == "__main__":
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS))
    known, others = parser.parse_known_args()
    sys.exit(run_cases(functools.partial(draw_case, known.commands), __doc__, others))
