"""Entry point of the `lgmd-gym` command: parse the arguments and run one command."""

import contextlib
import inspect
import io
import re
import sys
from importlib import import_module
from typing import Annotated, Any, Union

import tyro
from tyro.conf import subcommand

from lgmd_gym.cli import options

DESCRIPTION = """Simulate emergency braking on the spike frequency of a locust looming neuron (LGMD).

Examples:
  lgmd-gym bench                                 run all agents on the quick suite (about a minute)
  lgmd-gym drive LGMD/CCRs-v0 --video out.mp4    record one approach as a video
  lgmd-gym compare runs/A runs/B                 print the paired differences of two runs
  lgmd-gym video CLIP.mp4                        plot the spikes for a dash-camera clip
  lgmd-gym tune --agent nested-fields            search the parameters of a rule

Arguments are in SI units; case names contain speeds in km/h. Every command has its own --help."""

# Each command's options; the module `lgmd_gym.cli.<name>` has the function `run(options) -> exit code`.
COMMANDS: dict[str, type] = {
    "bench": options.Bench,
    "compare": options.Compare,
    "drive": options.Drive,
    "video": options.Video,
    "paper": options.Paper,
    "train": options.Train,
    "tune": options.Tune,
    "list": options.List,
    "gallery": options.Gallery,
    "doctor": options.Doctor,
}


def main(argv: list[str] | None = None) -> None:
    """Run the command line and exit; invalid input prints one line to stderr and exits with code 2."""
    sys.exit(run(argv))


def run(argv: list[str] | None = None) -> int:
    """Run one command and return its exit code."""
    try:
        command = _parse(argv)
        name = next(name for name, cls in COMMANDS.items() if isinstance(command, cls))
        return import_module(f"lgmd_gym.cli.{name}").run(command)
    except (ValueError, TypeError) as error:
        print(f"lgmd-gym: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("lgmd-gym: interrupted", file=sys.stderr)
        return 130


def _parse(argv: list[str] | None) -> Any:
    """Parse the arguments; a parser error becomes a one-line ValueError."""
    arguments = sys.argv[1:] if argv is None else argv
    if not arguments:
        raise ValueError(f"a command is required: {', '.join(COMMANDS)}; see lgmd-gym --help")
    stderr = io.StringIO()
    try:
        with contextlib.redirect_stderr(stderr):
            return tyro.cli(
                _command_type(),
                prog="lgmd-gym",
                description=DESCRIPTION,
                args=arguments,
                config=(
                    tyro.conf.OmitSubcommandPrefixes,
                    tyro.conf.OmitArgPrefixes,
                    tyro.conf.DisallowNone,
                ),
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        raise ValueError(_one_line(stderr.getvalue())) from None


def _command_type() -> Any:
    """Return the union of all option classes, each with its name and a one-line description."""
    commands = []
    for name, cls in COMMANDS.items():
        summary = (inspect.getdoc(cls) or "").splitlines()[0]
        commands.append(Annotated[cls, subcommand(name=name, description=summary)])
    return Union[tuple(commands)]  # noqa: UP007  (built from a table)


def _one_line(box: str) -> str:
    """Return the message in the parser's box, with the nearest option if the box suggests one."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", box)
    message = []
    for line in text.splitlines():
        words = line.strip("│╭╰╮╯ ")
        if words and not words.strip("─") and message:
            break  # a rule inside the box; the rest repeats the help
        if words and not line.startswith(("╭", "╰")) and words.strip("─"):
            message.append(words)
    nearest = re.search(r"Perhaps you meant:[^-]*(--[a-z][a-z-]*)", text)
    hint = f"; did you mean {nearest[1]}?" if nearest else "; see lgmd-gym --help"
    return re.sub(r" \(applied to [^)]*\)", "", " ".join(message)) + hint
