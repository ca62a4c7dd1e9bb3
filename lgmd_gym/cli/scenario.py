"""The `scenario` command: compare OpenSCENARIO files with their intent, export cases."""

import time
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from lgmd_gym.cli.console import make_console

if TYPE_CHECKING:
    from lgmd_gym.benchmark.openscenario.check import CheckedFile
    from lgmd_gym.cli.options import Scenario

COLUMNS = ("file", "cells", "contacts", "location [cm]", "speed [km/h]", "time [s]")


def run(options: "Scenario") -> int:
    """Run one action; return the exit code."""
    if not options.targets:
        needed = "a file or folder" if options.action == "check" else "the name of a case"
        raise ValueError(f"scenario {options.action} needs {needed}")
    return _check(options) if options.action == "check" else _export(options)


def _check(options: "Scenario") -> int:
    from lgmd_gym.benchmark.openscenario.check import check_files

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
    console.print(f"{len(checked)} files, {cells} cells, {contacts} contacts with the target, {wall:.0f} s")
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
    from lgmd_gym.benchmark.openscenario.export import export_case
    from lgmd_gym.benchmark.suites import find_case

    if len(options.targets) != 1:
        raise ValueError(f"scenario export needs one case, got {len(options.targets)}: {options.targets}")
    if options.to is None:
        raise ValueError("scenario export needs --to FILE.xosc")
    for path in export_case(find_case(options.targets[0]), options.to):
        make_console().print(str(path), soft_wrap=True)
    return 0
