"""Run odd command lines and report each that does not end with exit code 0 or 2 and at most one line.

python tests/fuzz/command_lines.py --seconds 120 --seed 0

All command lines run in this process, in a temporary folder, without long computations: an argument that is
valid for a long command goes with one that is not.
"""

import argparse
import contextlib
import io
import os
import random
import signal
import sys
import tempfile
import time
import traceback

from lgmd_gym.cli import main as cli

LIMIT_S = 20  # time after which a command counts as hanging [s]
NAMES = (
    "", " ", "-1", "0", "1e400", "nan", "-inf", "9" * 320, "true", "[red]x", "[/x]", "x" * 300, "\n", "ä€😀",
    ".", "..", "/", "nodir/x", "nodir/x.png", "/proc/x", "/dev/null", "text.toml", "bool.toml", "list.m3u8",
    "a/b/c", "quick", "LGMD/CCRs-v0", "spike-threshold", "policy:", "policy:text.toml",
    "spike-threshold:threshold=1e400", "spike-threshold:threshold=", "os:getcwd", "no.such:Thing", "%s",
    "$HOME", "~", "*", "a=b", "ego_speed=1e400", "ego_speed=nan", "shade=" + "9" * 400, "x.mp4", "x.gif",
    "hyper.yml",
)  # fmt: skip
FILES = {
    "text.toml": "not toml",
    "bool.toml": 'name = "b"\n[[cases]]\nfamily = "CCRs"\nname = "x"\narguments = {ego_speed = true}\n',
    "list.m3u8": "#EXTM3U\n#EXTINF:9.0,\nx.ts\n",
    "hyper.yml": "default: {n_timesteps: 1.0e+400}\n",
}
# The start of each command line, and a part that keeps it short: its value is never valid.
COMMANDS: dict[str, tuple[list[str], list[str]]] = {
    "bench": (["--suite", "--agents", "--seeds", "--first-seed", "--conditions", "--camera", "--params",
               "--config", "--resume", "--jobs", "--address", "--out"], ["--suite", "none"]),
    "compare": (["--agents", "--arms", "--out"], []),
    "drive": (["--agent", "--video", "--overlays", "--seed", "--camera", "--params", "--set"],
              ["--set", "none=1"]),
    "video": (["--configs", "--crashes", "--crash-frame", "--out", "--params", "--threshold", "--fps",
               "--drop-duplicates", "--size", "--roi"], ["--configs", "none"]),
    "paper": (["--out", "--clips", "--crashes", "--picture"], ["--picture", "none"]),
    "stimuli": (["--out", "--fps", "--size", "--suffix", "--picture", "--check"], ["--suffix", "none"]),
    "train": (["--algo", "--env", "--camera", "--sensors-of", "--inputs", "--demands", "--n-timesteps",
               "--seed", "--hyperparams", "--eval-freq", "--eval-episodes", "--recordings", "--resume",
               "--traffic-episodes", "--jobs", "--out"], ["--hyperparams", "none"]),
    "tune": (["--agent", "--cameras", "--neuron", "--trials", "--levels", "--seeds", "--false-cost", "--jobs",
              "--study", "--best"], ["--jobs", "0"]),
    "gallery": (["--out", "--families", "--agent", "--seeds"], ["--seeds", "0"]),
    "list": ([], []),
    "neurons list": (["--module"], ["--module", "none"]),
    "neurons compare": (["--parts", "--clips", "--crashes", "--clip-fps", "--clip-cap", "--camera",
                         "--suites", "--seeds", "--first-world", "--test-world", "--jobs", "--module",
                         "--out"], ["--parts", "none"]),
    "neurons events": (["--neuron", "--fps", "--out"], ["--fps", "0"]),
}  # fmt: skip


def command_line(rng: random.Random) -> list[str]:
    """Return a random command line."""
    command = rng.choice(list(COMMANDS))
    options, short = COMMANDS[command]
    line = [*command.split(), *rng.choices(NAMES, k=rng.choice((0, 1, 1, 2)))]
    for option in rng.sample(options, min(len(options), rng.randint(0, 3))):
        line += [option, *rng.choices(NAMES, k=rng.choice((1, 1, 1, 2, 4)))]
    return line + short


def finding(line: list[str]) -> str | None:
    """Run a command line; return what is wrong with its end, or None."""
    stdout, stderr = io.StringIO(), io.StringIO()
    code: object = None
    signal.alarm(LIMIT_S)
    try:
        with contextlib.redirect_stdout(stdout), contextlib.redirect_stderr(stderr):
            code = cli.run(line)
    except SystemExit as stop:
        code = stop.code or 0
    except BaseException as error:  # every other end is a finding
        place = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__}: {str(error)[:120]!r} at {place.filename}:{place.lineno}"
    finally:
        signal.alarm(0)
    lines = stderr.getvalue().splitlines()
    if code not in (0, 2) or (code == 2 and len(lines) != 1):
        return f"exit {code} with {len(lines)} lines: {lines[-1:]}"
    return None


def _hang(*_: object) -> None:
    raise TimeoutError(f"no end within {LIMIT_S} s")


def main() -> int:
    """Run command lines until the time is over; return 1 for any finding."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="time to run [s]")
    parser.add_argument("--seed", type=int, default=0, help="seed of the command lines")
    options = parser.parse_args()
    rng, end, count, found = random.Random(options.seed), time.monotonic() + options.seconds, 0, set()
    signal.signal(signal.SIGALRM, _hang)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, text in FILES.items():
            with open(name, "w", encoding="utf-8") as file:
                file.write(text)
        while time.monotonic() < end:
            line, count = command_line(rng), count + 1
            if (problem := finding(line)) and problem not in found:
                found.add(problem)
                print(f"{[text[:60] for text in line]}\n    {problem}", flush=True)
        os.chdir("/")
    print(f"{count} command lines, {len(found)} findings")
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
