"""Reading of OpenSCENARIO XML 1.0 to 1.3 as suites."""

import re
import warnings
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os.path import normpath
from pathlib import Path

from lgmd_gym.benchmark.case import Case, Suite, file_name, repetitions, scenario_case
from lgmd_gym.camera import CLEAR
from lgmd_gym.errors import InputNote, check_path, counted
from lgmd_gym.openscenario.compiler import Compiled, compile_scenario
from lgmd_gym.openscenario.nodes import ConstraintError, Element, Node, parse_file
from lgmd_gym.openscenario.parameters import Assignment, declare, variations

_SHORT = (
    (re.compile(r"Ego_(final_?|init_?)?speed(_kph)?", re.I), "v"),
    (re.compile(r"\w+_(final_?|init_?)?speed(_kph)?", re.I), "target"),
    (re.compile(r"ImpactLocation", re.I), "impact"),
    (re.compile(r"\w*overlap", re.I), "overlap"),
    (re.compile(r"\w*headway", re.I), "headway"),
    (re.compile(r"\w*deceleration", re.I), "decel"),
    (re.compile(r"ImpactSide", re.I), "side"),
)
_FIRST = ("v", "target", "overlap", "impact", "headway", "decel")


def short_name(parameter: str) -> str:
    """Return the short name of a parameter, such as "v" for the ego's speed."""
    for pattern, short in _SHORT:
        if pattern.fullmatch(parameter):
            return short
    return file_name(parameter.split("_")[-1]).lower()


def variants(cells: Sequence[dict[str, str]], speeds: Sequence[float]) -> list[str]:
    """Return a name for each cell; all names are different.

    A name contains the ego's speed in km/h and the values of the parameters that, together with it,
    distinguish the cells; parameters that vary along with them are left out.

    Args:
        cells: Values of the varied parameters of each cell; the keys of all cells are the same.
        speeds: Initial ego speed of each cell [m/s].
    """
    parts: list[list[str]] = [[f"v{_number(speed * 3.6)}"] for speed in speeds]
    names = list(cells[0]) if cells else []
    names.sort(key=lambda name: _rank(name, cells[0][name]))
    for name in names:
        if short_name(name) == "v" or len({cell[name] for cell in cells}) == 1:
            continue
        longer = [[*part, _text(name, cell[name])] for part, cell in zip(parts, cells, strict=True)]
        if len({*map(tuple, longer)}) > len({*map(tuple, parts)}):
            parts = longer
    found = ["/".join(part) for part in parts]
    return [name + suffix for name, suffix in zip(found, repetitions(found), strict=True)]


def _rank(name: str, value: str) -> int:
    """Return the place of a parameter in names: known ones first, paths of files last."""
    short = short_name(name)
    return _FIRST.index(short) if short in _FIRST else len(_FIRST) + ("/" in value)


def _text(name: str, value: str) -> str:
    try:
        return f"{short_name(name)}{_number(float(value))}"
    except ValueError:
        return file_name(value.rsplit("/", 1)[-1].rsplit("_", 1)[-1]).lower()


def _number(value: float) -> str:
    return f"{round(value, 6):g}"


SUFFIX = ".xosc"
FAMILY = "Scenario_ID"  # parameter that names the family
VERSIONS = ("0", "1", "2", "3")
DRIVER = "lgmd_gym.fcw_driver"
"""Property of the file: whether the driver brakes after the alert."""
FCW = "_FCW"
"""Part of the name of a file or of its `Scenario_ID` that marks tests in which the driver brakes."""


@dataclass(frozen=True)
class Cell:
    """A cell of a file."""

    variant: str  # name within its family and file
    compiled: Compiled  # the scenario
    fcw_driver: bool  # whether the driver brakes after the alert


def notes_of(cells: Sequence[Cell]) -> tuple[str, ...]:
    """Return the notes of the cells of a file, each once, with the number of cells if it is not all."""
    counts = Counter(note for cell in cells for note in cell.compiled.notes)
    total = len(cells)
    return tuple(
        note if count == total else f"{note} (in {count} of {counted(total, 'cell')})"
        for note, count in counts.items()
    )


def _noted(cells: list[Cell]) -> list[Cell]:
    """Return cells, and warn of their notes."""
    for note in notes_of(cells):
        warnings.warn(note, InputNote, stacklevel=3)
    return cells


def read(path: str | Path, parameters: Mapping[str, str] | None = None) -> Suite:
    """Return the cells of an OpenSCENARIO file as a suite.

    A case is named `stem/family/variant`: the file's stem, the parameter `Scenario_ID` or else the stem of
    the scenario file, and the ego's speed in km/h with the other varied parameters. In a cell of a file with
    "_FCW" in its stem or `Scenario_ID`, the driver brakes after the agent's alert (`Case.fcw_driver`). An
    `Environment` at night, in fog or in rain sets the weather. An event that never starts gives a warning of
    the class `lgmd_gym.errors.InputNote`.

    Args:
        path: A scenario, or a file that varies the parameters of one.
        parameters: Values of parameters by name, instead of those of the file in every cell.

    Raises:
        ValueError: If the file cannot be read, or contains something that is not supported. The message
            begins with the file and line.
    """
    path = check_path("path", path)
    suite = file_name(path.stem)
    cases = tuple(_case(suite, cell) for cell in _noted(read_cells(path, None, parameters)))
    return Suite(name=suite, cases=cases, about=f"OpenSCENARIO {path.name}")


def read_all(paths: Sequence[str | Path], parameters: Mapping[str, str] | None = None) -> Suite:
    """Return the cells of several files and folders as one suite.

    A folder stands for its files that vary parameters, and for all its scenarios if there is none; catalogs
    are left out. The suite's name is that of the folder that contains all files; a case is named
    `folder/family/file/variant`, with the path of the file in the folder.

    Args:
        paths: The files and folders.
        parameters: See `read`.

    Raises:
        ValueError: See `read`; or if there is no file.
    """
    found = [file for path in paths for file in find_files(check_path("path", path))]
    files = list({file.resolve(): file for file in found}.values())
    if not files:
        raise ValueError("suite must contain at least one file or folder, got none")
    if len(files) == 1:
        return read(files[0], parameters)
    stems = [file.resolve().with_suffix("").parts for file in files]
    common = 0
    while all(len(parts) > common + 1 and parts[common] == stems[0][common] for parts in stems):
        common += 1
    suite = file_name(stems[0][common - 1])
    cases: list[Case] = []
    for file, parts in zip(files, stems, strict=True):
        inside = "/".join(file_name(part) for part in parts[common:])
        cases += [_case(suite, cell, f"{inside}/") for cell in _noted(read_cells(file, None, parameters))]
    return Suite(name=suite, cases=tuple(cases), about=f"OpenSCENARIO, {counted(len(files), 'file')}")


def find_files(path: Path) -> list[Path]:
    """Return an OpenSCENARIO file, or the files of a folder and its sub-folders; see `read_all`."""
    if not path.is_dir():
        return [path]
    found: dict[str, list[Path]] = {"ParameterValueDistribution": [], "Storyboard": []}
    for file in sorted(path.rglob(f"*{SUFFIX}")):
        for tag in found.keys() & {node.tag for node in parse_file(file).children}:
            found[tag].append(file)
    files = found["ParameterValueDistribution"] or found["Storyboard"]
    if not files:
        raise ValueError(f"suite: folder {str(path)!r} contains no scenario ({SUFFIX}); check the path")
    return files


def read_cells(
    path: Path, limit: int | None = None, parameters: Mapping[str, str] | None = None
) -> list[Cell]:
    """Return the cells of a file, in the order of its variations.

    Args:
        path: The file.
        limit: Number of cells to read; None for all.
        parameters: See `read`.
    """
    root = _root(path)
    distribution = root.find("ParameterValueDistribution")
    if distribution is None:
        return _cells(path, path, root.node, [{}], parameters)
    target = distribution.child("ScenarioFile")
    file = Path(normpath(target.path("filepath")))
    scenario = _root(file)
    if scenario.find("Storyboard") is None:
        raise target.error(f"{str(file)!r} is no scenario; ScenarioFile must name one with a Storyboard")
    return _cells(path, file, scenario.node, variations(distribution), parameters, limit)


def _root(path: Path) -> Element:
    root = Element(parse_file(path), {})
    if root.tag != "OpenSCENARIO":
        raise root.error(f"an OpenSCENARIO file must begin with OpenSCENARIO, got {root.tag}")
    if root.find("ParameterValueDistribution", "Storyboard") is None:
        found = ", ".join(node.tag for node in root.node.children) or "nothing"
        raise root.error(f"the file has no Storyboard or ParameterValueDistribution, got {found}")
    header = root.child("FileHeader")
    version = header.text("revMajor"), header.text("revMinor")
    if version[0] != "1" or version[1] not in VERSIONS:
        raise header.error(f"OpenSCENARIO {'.'.join(version)} is not supported; use 1.0 to 1.3")
    return root


def _cells(
    path: Path,
    file: Path,
    root: Node,
    given: Sequence[dict[str, Assignment]],
    parameters: Mapping[str, str] | None,
    limit: int | None = None,
) -> list[Cell]:
    chosen = {name: Assignment(value, root) for name, value in (parameters or {}).items()}
    cells: list[Compiled] = []
    varied: list[dict[str, str]] = []
    violations: list[ConstraintError] = []
    names = dict.fromkeys(name for assignments in given for name in assignments)
    for assignments in given:
        if len(cells) == limit:
            break
        try:
            scope = declare(Element(root, {}), assignments | chosen)
        except ConstraintError as error:
            violations.append(error)
            continue
        family = file_name(scope.get(FAMILY, file.stem))
        cells.append(compile_scenario(Element(root, scope), family))
        given_here = {name: item.value for name, item in assignments.items()}
        varied.append({name: given_here.get(name, scope.get(name, "")) for name in names})
    if violations:
        if not cells:
            raise violations[0]
        total = counted(len(cells) + len(violations), "cell")
        note = f"{violations[0]}; {len(violations)} of {total} left out for such a value"
        cells = [replace(cell, notes=(*cell.notes, note)) for cell in cells]
    variant_names = variants(varied, [cell.scenario.ego_speed for cell in cells])
    drivers = [
        FCW in path.stem or FCW in cell.scenario.family or cell.properties.get(DRIVER) == "true"
        for cell in cells
    ]
    return list(map(Cell, variant_names, cells, drivers))


def _case(suite: str, cell: Cell, prefix: str = "") -> Case:
    weather, scenario = cell.compiled.weather, cell.compiled.scenario
    arguments = {} if weather == CLEAR else {"weather": weather}
    return scenario_case(suite, prefix + cell.variant, scenario, cell.fcw_driver, **arguments)
