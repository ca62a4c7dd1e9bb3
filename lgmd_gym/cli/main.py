"""Entry point of the `lgmd-gym` command: parse the arguments and run one command."""

import contextlib
import io
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Union

import tyro
from tyro.conf import subcommand

from lgmd_gym._version import __version__
from lgmd_gym.cli.bench import Bench
from lgmd_gym.cli.compare import Compare
from lgmd_gym.cli.console import activity, drop_output, io_reason, prepare_streams, printed_notes
from lgmd_gym.cli.doctor import Doctor
from lgmd_gym.cli.drive import Drive
from lgmd_gym.cli.gallery import Gallery
from lgmd_gym.cli.help import description, documented, one_line, summary, wrapped_output
from lgmd_gym.cli.list import List
from lgmd_gym.cli.neurons import Neurons
from lgmd_gym.cli.paper import Paper
from lgmd_gym.cli.scenario import Scenario
from lgmd_gym.cli.stimuli import Stimuli
from lgmd_gym.cli.train import Train
from lgmd_gym.cli.tune import Tune
from lgmd_gym.cli.video import Video
from lgmd_gym.errors import unknown_name
from lgmd_gym.processes.pool import end_workers
from lgmd_gym.processes.signals import raise_on_signals

DESCRIPTION = """Simulate emergency braking on the spike frequency of a locust looming neuron (LGMD).

Examples:
  lgmd-gym bench                               compare braking agents on one screen
  lgmd-gym drive LGMD/CCRs-v0 --video out.mp4  record one approach as a video
  lgmd-gym compare runs/A runs/B               compare two runs in pairs
  lgmd-gym video CLIP.mp4                      plot the spikes for a video clip
  lgmd-gym neurons compare lgmd off-only       compare neuron models
  lgmd-gym tune --agent stopping-zone          search the parameters of a rule

Arguments are in SI units; case names contain speeds in km/h. Every command has its own --help.
lgmd-gym --version prints the version."""

INTERRUPTED = 130  # exit code of a command that was interrupted

# Each command's options; its module has the function `run(options) -> exit code` and imports the rest there.
COMMANDS: dict[str, type] = {
    "bench": Bench,
    "compare": Compare,
    "drive": Drive,
    "video": Video,
    "neurons": Neurons,
    "paper": Paper,
    "stimuli": Stimuli,
    "train": Train,
    "tune": Tune,
    "list": List,
    "scenario": Scenario,
    "gallery": Gallery,
    "doctor": Doctor,
}


def main(argv: list[str] | None = None) -> None:
    """Run the command line and exit; invalid input prints one line to stderr and exits with code 2."""
    code = run(argv)
    end_workers()
    sys.exit(code)


def run(argv: list[str] | None = None) -> int:
    """Run one command and return its exit code; Ctrl-C and SIGTERM interrupt it."""
    prepare_streams()
    with raise_on_signals() as interruption:
        code = _run(argv)
        return interruption.exit_code if code == INTERRUPTED else code


def _run(argv: list[str] | None) -> int:
    arguments = sys.argv[1:] if argv is None else argv
    if arguments[:1] == ["--version"]:
        print(f"lgmd-gym {__version__}")
        return 0
    try:
        Path.cwd()
    except FileNotFoundError:
        print("lgmd-gym: the working folder was deleted; change to another with cd", file=sys.stderr)
        return 2
    try:
        command = _parse(arguments)
        name = next(name for name, cls in COMMANDS.items() if isinstance(command, cls))
        with activity("loading"):
            module = import_module(f"lgmd_gym.cli.{name}")
        with printed_notes():
            code = module.run(command)
        sys.stdout.flush()
        return code
    except (ValueError, TypeError, OverflowError) as error:
        print(f"lgmd-gym: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"lgmd-gym: the memory is full ({error or 'no size given'})", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"lgmd-gym: {io_reason(error)}", file=sys.stderr)
        drop_output()
        return 2
    except KeyboardInterrupt:
        print("lgmd-gym: interrupted", file=sys.stderr)
        return INTERRUPTED


def _parse(arguments: list[str]) -> Any:
    """Parse the arguments; a parser error becomes a one-line ValueError."""
    if not arguments:
        raise ValueError(f"a command is required: {', '.join(COMMANDS)}; see lgmd-gym --help")
    if arguments[0] not in (*COMMANDS, "-h", "--help"):
        raise unknown_name("command", arguments[0], COMMANDS)
    command = _named_command(arguments)
    stderr = io.StringIO()
    try:
        with contextlib.redirect_stderr(stderr), wrapped_output():
            return tyro.cli(
                _command_type(arguments[0]),
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
        raise ValueError(one_line(stderr.getvalue(), command)) from None


def _named_command(arguments: list[str]) -> str:
    """Return the command, with its subcommand if it has some.

    Raises:
        ValueError: For a missing or unknown subcommand.
    """
    command, *rest = arguments
    known: dict[str, type] = getattr(COMMANDS.get(command), "SUBCOMMANDS", {})
    if not known or (rest and rest[0] in ("-h", "--help")):
        return command
    if not rest:
        raise ValueError(
            f"{command} requires a subcommand: {', '.join(known)}; see lgmd-gym {command} --help"
        )
    if rest[0] not in known:
        raise unknown_name(f"subcommand of {command}", rest[0], known)
    return f"{command} {rest[0]}"


def _command_type(chosen: str) -> Any:
    """Return the union of all option classes, each with its name; the chosen command has its whole help."""
    commands: list[object] = []
    for name, cls in COMMANDS.items():
        if name == chosen:
            commands.append(Annotated[documented(cls), subcommand(name=name, description=description(cls))])
        else:
            # The options of subcommands are not needed here.
            given: Any = dataclass(type(name, (), {})) if hasattr(cls, "SUBCOMMANDS") else cls
            commands.append(Annotated[given, subcommand(name=name, description=summary(cls))])
    return Union[tuple(commands)]  # noqa: UP007  (built from a table)
