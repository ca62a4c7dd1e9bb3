"""The `scenario` command; the attribute docstrings of `Scenario` are its help texts."""

import time
from dataclasses import dataclass
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.table import Table
from tyro.conf import Positional, arg

from lgmd_gym.cli.console import make_console, note
from lgmd_gym.cli.values import File, Name, Names, find_target
from lgmd_gym.errors import counted

if TYPE_CHECKING:
    from lgmd_gym.aliases import Arguments
    from lgmd_gym.benchmark.case import Case
    from lgmd_gym.envs.families.scenario import Scenario as FamilyScenario
    from lgmd_gym.openscenario.check import CheckedFile

NEEDED = {
    "show": "a file, an environment id or a case",
    "check": "a file or folder",
    "export": "a file, an environment id or a case",
}
COLUMNS = ("file", "cells", "contacts", "location [cm]", "speed [km/h]", "time [s]")


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """Write, draw, check or export scenarios.

    lgmd-gym scenario new [FILE.toml] writes a commented scenario file to start from. lgmd-gym scenario show
    TARGET draws a scenario file, an OpenSCENARIO file, an environment id or a case from above at several
    times, with all speeds, as a picture. lgmd-gym scenario check PATH [PATH ...] plays every cell of
    OpenSCENARIO files and folders without braking, and prints one row per file: the cells, the contacts, and
    the largest deviations of impact location, impact speed and time from what the parameters and positions of
    the file state. lgmd-gym scenario export TARGET --to FILE.xosc writes what show draws as
    OpenSCENARIO 1.3, and its road as OpenDRIVE next to it.
    """

    action: Positional[Literal["new", "show", "check", "export"]]
    """Write a template, draw a scenario, compare files, or export a case."""
    targets: Annotated[Positional[tuple[str, ...]], arg(metavar="FILE|PATH|CASE [PATH ...]")]
    """File to write (default: scenario.toml); scenario to draw or export, for example quick/CCRs/v30; or
    files and folders to compare."""
    to: File = None
    """Picture (.png, .svg; default: TARGET.png) or OpenSCENARIO file (.xosc) to write; must not exist."""
    force: bool = False
    """Replace an existing template or picture."""
    case: Name = None
    """Case to draw or export, of a file with several."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    trust: bool = False
    """Load the modules that the file names; they can run any code."""
    set: Annotated[tuple[str, ...], arg(metavar="NAME=VALUE [...]")] = ()
    """Arguments of the scenario to draw or export, in SI units; for an OpenSCENARIO file, values of its
    parameters."""
    jobs: int = 2
    """Number of processes that compare files."""


def run(options: Scenario) -> int:
    """Run one action; return the exit code."""
    if options.action == "new":
        return _new(options)
    if not options.targets:
        raise ValueError(f"scenario {options.action} needs {NEEDED[options.action]}")
    actions = {"show": _show, "check": _check, "export": _export}
    return actions[options.action](options)


def _new(options: Scenario) -> int:
    from lgmd_gym.benchmark.suites import write_template

    if len(options.targets) > 1:
        raise ValueError(f"scenario new writes one file, got {len(options.targets)}: {options.targets}")
    path = write_template((options.targets or ("scenario.toml",))[0], options.force)
    make_console().print(f"{path}: edit it, then lgmd-gym scenario show {path}", soft_wrap=True)
    return 0


def _show(options: Scenario) -> int:
    from lgmd_gym.benchmark.case import Case, file_name
    from lgmd_gym.envs.motion import record_motion
    from lgmd_gym.plotting.figures import scenario_figure
    from lgmd_gym.processes.files import check_output_file

    target, _, scenario = _find(options)
    given = options.targets[0]
    name = target.name if isinstance(target, Case) else target
    stem = Path(given).stem if isinstance(target, Case) and options.case is None else name.replace("/", "_")
    path = options.to or Path(f"{file_name(stem)}.png")
    check_output_file(path, "picture", options.force)
    motion = record_motion(scenario)
    scenario_figure(path, name, motion)
    end = "contact" if motion.contact else "no contact"
    make_console().print(f"{path}: {end} after {motion.times[-1]:.2f} s without braking", soft_wrap=True)
    return 0


def _find(options: Scenario) -> "tuple[str | Case, Arguments, FamilyScenario]":
    """Return the target of `show` and `export`, the arguments of `--set` and the scenario with them."""
    from lgmd_gym.rendering.playback import make_target

    if len(options.targets) != 1:
        raise ValueError(
            f"scenario {options.action} needs one scenario, got {len(options.targets)}: {options.targets}"
        )
    given = options.targets[0]
    target, arguments = find_target(given, options.case, options.module, options.trust, options.set)
    scenario = getattr(make_target(target, arguments, camera=None).unwrapped, "scenario", None)
    if scenario is None:
        raise ValueError(f"{given} has no scenario to {options.action}; traffic is played by lgmd-gym drive")
    return target, arguments, scenario


def _check(options: Scenario) -> int:
    from lgmd_gym.openscenario.check import check_files

    if options.to is not None:
        raise ValueError(f"scenario check writes no file, got --to {str(options.to)!r}; remove it")
    console, start = make_console(), time.perf_counter()
    checked = list(check_files(options.targets, options.jobs))
    table = Table(*COLUMNS, title="largest deviations from the intent of the file")
    table.columns[0].overflow = "fold"
    for column in table.columns[1:]:
        column.justify = "right"
    for item in checked:
        table.add_row(*_row(item))
    console.print(table)
    for text in (text for item in checked for text in item.notes):
        note(text)
    cells, contacts = sum(item.cells for item in checked), sum(item.contacts for item in checked)
    wall = time.perf_counter() - start
    console.print(
        f"{counted(len(checked), 'file')}, {counted(cells, 'cell')}, "
        f"{counted(contacts, 'contact')} with the target, {wall:.0f} s"
    )
    return 0


def _row(item: "CheckedFile") -> list[str]:
    name = str(Path(*item.path.with_suffix("").parts[-2:]))
    deviations = (100.0 * item.location, 3.6 * item.speed, item.time)
    texts = [
        "–" if isnan(value) else format(value, f".{digits}f")
        for value, digits in zip(deviations, (2, 3, 4), strict=True)
    ]
    return [name, str(item.cells), str(item.contacts), *texts]


def _export(options: Scenario) -> int:
    from lgmd_gym.benchmark.case import scenario_case
    from lgmd_gym.benchmark.suites import find_case, own_case
    from lgmd_gym.envs.registration import APPEARANCE
    from lgmd_gym.openscenario.export import export_case

    if options.to is None:
        raise ValueError("scenario export needs --to FILE.xosc")
    target, arguments, scenario = _find(options)
    if isinstance(target, str):
        target = own_case(scenario) if target.startswith("LGMD/") else find_case(target)
    looks = target.appearance | {name: value for name, value in arguments.items() if name in APPEARANCE}
    case = scenario_case(target.suite, target.variant, scenario, target.fcw_driver, **looks)
    for path in export_case(case, options.to):
        make_console().print(str(path), soft_wrap=True)
    return 0
