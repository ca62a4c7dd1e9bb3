"""The `scenario` command: write templates, draw scenarios, check OpenSCENARIO files, export cases."""

import time
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from lgmd_gym.cli.console import make_console
from lgmd_gym.errors import counted
from lgmd_gym.openscenario.names import file_name

if TYPE_CHECKING:
    from lgmd_gym.cli.options import Scenario
    from lgmd_gym.openscenario.check import CheckedFile

NEEDED = {
    "show": "a file, an environment id or a case",
    "check": "a file or folder",
    "export": "the name of a case",
}
COLUMNS = ("file", "cells", "contacts", "location [cm]", "speed [km/h]", "time [s]")


def run(options: "Scenario") -> int:
    """Run one action; return the exit code."""
    if options.action == "new":
        return _new(options)
    if not options.targets:
        raise ValueError(f"scenario {options.action} needs {NEEDED[options.action]}")
    actions = {"show": _show, "check": _check, "export": _export}
    return actions[options.action](options)


def _new(options: "Scenario") -> int:
    from lgmd_gym.benchmark.scenario_template import write_template

    if len(options.targets) > 1:
        raise ValueError(f"scenario new writes one file, got {len(options.targets)}: {options.targets}")
    path = write_template((options.targets or ("scenario.toml",))[0], options.force)
    make_console().print(f"{path}: edit it, then lgmd-gym scenario show {path}", soft_wrap=True)
    return 0


def _show(options: "Scenario") -> int:
    from lgmd_gym.benchmark.case import Case
    from lgmd_gym.cli.modules import find_target
    from lgmd_gym.cli.params import parse_arguments
    from lgmd_gym.envs.motion import record_motion
    from lgmd_gym.plotting.scenario_figure import scenario_figure
    from lgmd_gym.processes.files import check_output_file
    from lgmd_gym.rendering.playback import make_target

    if len(options.targets) != 1:
        raise ValueError(f"scenario show draws one scenario, got {len(options.targets)}: {options.targets}")
    given = options.targets[0]
    target = find_target(given, options.case, options.module, options.trust)
    env = make_target(target, parse_arguments(options.set), camera=None).unwrapped
    scenario = getattr(env, "scenario", None)
    if scenario is None:
        raise ValueError(f"{given} has no scenario to draw; traffic is drawn by lgmd-gym drive")
    name = target.name if isinstance(target, Case) else target
    stem = Path(given).stem if isinstance(target, Case) and options.case is None else name.replace("/", "_")
    path = options.to or Path(f"{file_name(stem)}.png")
    check_output_file(path, "picture", options.force)
    motion = record_motion(scenario)
    scenario_figure(path, name, motion)
    end = "contact" if motion.contact else "no contact"
    make_console().print(f"{path}: {end} after {motion.times[-1]:.2f} s without braking", soft_wrap=True)
    return 0


def _check(options: "Scenario") -> int:
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


def _export(options: "Scenario") -> int:
    from lgmd_gym.benchmark.suites import find_case
    from lgmd_gym.openscenario.export import export_case

    if len(options.targets) != 1:
        raise ValueError(f"scenario export needs one case, got {len(options.targets)}: {options.targets}")
    if options.to is None:
        raise ValueError("scenario export needs --to FILE.xosc")
    for path in export_case(find_case(options.targets[0]), options.to):
        make_console().print(str(path), soft_wrap=True)
    return 0
