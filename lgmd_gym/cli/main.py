"""The `lgmd-gym` command: bench, compare, drive, video, paper, train, tune, list, gallery, doctor."""

import contextlib
import io
import re
import sys
from collections.abc import Callable
from typing import Annotated, Any, Union, get_args

import tyro
from tyro.conf import subcommand

from lgmd_gym.cli.options import (
    Bench,
    Compare,
    Doctor,
    Drive,
    Gallery,
    Judge,
    List,
    Paper,
    Train,
    Tune,
    Video,
)

DESCRIPTION = """A highway-env car brakes on the spike frequency of a locust looming neuron (LGMD).

  lgmd-gym bench                                    try all agents on the quick suite; about a minute
  lgmd-gym compare runs/A runs/B                    paired differences of two runs
  lgmd-gym drive LGMD/CCRs-v0 --video out.mp4       watch one approach through the eye
  lgmd-gym video CLIP.mp4                           the spike trace of a dash-camera clip
  lgmd-gym paper                                    the paper's experiments, a verdict on each claim
  lgmd-gym tune --agent fovea                       search a rule's parameters on training levels
  lgmd-gym train                                    a policy that learns to brake, with stable-baselines3
  lgmd-gym list                                     suites, agents, environments, cameras
  lgmd-gym gallery                                  a page of every scenario, to look at
  lgmd-gym doctor                                   is everything in place?

Speeds are in m/s, case names carry km/h. Each command has its own --help."""


Command = Union[  # noqa: UP007  (tyro reads the annotations)
    Annotated[Bench, subcommand(name="bench")],
    Annotated[Drive, subcommand(name="drive")],
    Annotated[List, subcommand(name="list")],
    Annotated[Video, subcommand(name="video")],
    Annotated[Paper, subcommand(name="paper")],
    Annotated[Tune, subcommand(name="tune")],
    Annotated[Train, subcommand(name="train")],
    Annotated[Compare, subcommand(name="compare")],
    Annotated[Judge, subcommand(name="judge")],
    Annotated[Gallery, subcommand(name="gallery")],
    Annotated[Doctor, subcommand(name="doctor")],
]


def main(argv: list[str] | None = None) -> None:
    """Run the command line; exits with 2 and one line on stderr for bad input."""
    sys.exit(run(argv))


def run(argv: list[str] | None = None) -> int:
    """Run one command and return its exit code."""
    try:
        command = _parse(argv)
        from lgmd_gym.cli import bench as commands_bench
        from lgmd_gym.cli import commands
        from lgmd_gym.cli import paper as commands_paper
        from lgmd_gym.cli import train as commands_train
        from lgmd_gym.cli import tune as commands_tune

        plays: dict[type, Callable[[Any], int]] = {
            Bench: commands_bench.bench,
            Compare: commands_bench.compare,
            Judge: commands_bench.judge,
            Drive: commands.drive,
            Video: commands_paper.video,
            Paper: commands_paper.paper,
            Train: commands_train.train,
            List: commands.show_list,
            Tune: commands_tune.tune,
            Gallery: commands.gallery,
            Doctor: commands.doctor,
        }
        return plays[type(command)](command)
    except (ValueError, TypeError) as error:
        print(f"lgmd-gym: {' '.join(str(error).split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("lgmd-gym: interrupted", file=sys.stderr)
        return 130


def _parse(argv: list[str] | None) -> Any:
    """Parse the arguments; what the parser complains of becomes a one-line ValueError."""
    given = sys.argv[1:] if argv is None else argv
    names = [get_args(item)[1].name for item in get_args(Command)]
    if not given:
        raise ValueError(f"which command? One of {', '.join(names)}; see lgmd-gym --help")
    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            return tyro.cli(
                Command,  # type: ignore[arg-type]
                prog="lgmd-gym",
                description=DESCRIPTION,
                args=given,
                config=(tyro.conf.OmitSubcommandPrefixes, tyro.conf.OmitArgPrefixes),
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        raise ValueError(_one_line(complaint.getvalue())) from None


def _one_line(box: str) -> str:
    """Return what the parser's boxed message says is wrong, and the nearest option if it names one."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", box)
    wrong = []
    for line in text.splitlines():
        words = line.strip("│╭╰╮╯ ")
        if words and not words.strip("─") and wrong:
            break  # a rule inside the box: what follows repeats the help
        if words and not line.startswith(("╭", "╰")) and words.strip("─"):
            wrong.append(words)
    nearest = re.search(r"Perhaps you meant:[^-]*(--[a-z][a-z-]*)", text)
    mend = f"; did you mean {nearest[1]}?" if nearest else "; see lgmd-gym --help"
    return re.sub(r" \(applied to [^)]*\)", "", " ".join(wrong)) + mend
