"""Coverage of OpenSCENARIO: how many files of a folder load, and why the others are refused.

    python docs/experiments/openscenario_coverage.py FOLDER [--files]

A row is a folder within FOLDER, such as a repository. Files without a storyboard, which are catalogs, are not
counted; of a file that varies parameters, the first 10 cells are read. `--files` adds the result of each
file. The tables are in Markdown.
"""

import argparse
import re
import warnings
from collections import Counter
from pathlib import Path
from typing import NamedTuple

from lgmd_gym.errors import InputNote
from lgmd_gym.openscenario.nodes import parse_file
from lgmd_gym.openscenario.reader import SUFFIX, read_cells

CELLS = 10
"""Number of cells that are read of a file that varies parameters."""
_SCENARIO = {"Storyboard", "ParameterValueDistribution"}


class Outcome(NamedTuple):
    """Outcome of one file."""

    folder: str  # folder within the root that contains the file
    path: Path
    error: str  # message without file and line; empty if the file loads


def outcomes(root: Path) -> list[Outcome]:
    """Return the outcome of each scenario file of a folder and its sub-folders."""
    found: list[Outcome] = []
    for path in sorted(root.rglob(f"*{SUFFIX}")):
        parts = path.relative_to(root).parts
        folder = parts[0] if len(parts) > 1 else "."
        try:
            tags = {node.tag for node in parse_file(path).children}
        except ValueError as error:
            found.append(Outcome(folder, path, _reason(str(error))))
            continue
        if tags & _SCENARIO:
            found.append(Outcome(folder, path, _outcome(path)))
    return found


def _outcome(path: Path) -> str:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InputNote)
            read_cells(path, CELLS)
    except ValueError as error:
        return _reason(str(error))
    return ""


def _reason(message: str) -> str:
    """Return a message without the file and line at its beginning."""
    return re.sub(r"^\S.*?:\d+: ", "", message, count=1)


def kind_of(error: str) -> str:
    """Return an error without names and numbers, so that equal reasons have equal texts."""
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "…", error)
    return re.sub(r"(?<!\w)-?\d+(\.\d+)?(e[+-]?\d+)?", "…", text)[:110]


def print_tables(found: list[Outcome]) -> None:
    """Print the number of files that load by folder, and the reasons of the others by frequency."""
    print("| folder | scenario files | load | share |\n|---|---|---|---|")
    for folder in dict.fromkeys(item.folder for item in found):
        files = [item for item in found if item.folder == folder]
        loads = sum(not item.error for item in files)
        print(f"| {folder} | {len(files)} | {loads} | {loads / len(files):.0%} |")
    print("\n| files | reason |\n|---|---|")
    for reason, count in Counter(kind_of(item.error) for item in found if item.error).most_common():
        print(f"| {count} | {reason} |")


def main() -> None:
    """Read the files and print the tables."""
    parser = argparse.ArgumentParser(description="Count the OpenSCENARIO files that load.")
    parser.add_argument("folder", type=Path, help="folder with repositories")
    parser.add_argument("--files", action="store_true", help="also print the result of each file")
    options = parser.parse_args()
    found = outcomes(options.folder)
    print_tables(found)
    for item in found if options.files else ():
        print(f"{item.path.relative_to(options.folder)}: {item.error or 'loads'}")


if __name__ == "__main__":
    main()
