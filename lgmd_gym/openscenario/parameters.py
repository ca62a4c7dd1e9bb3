"""Parameters: declarations, constraints, assignments, files that vary them, and catalogs."""

import operator
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache
from itertools import product
from math import floor
from pathlib import Path
from typing import Any, NamedTuple

from lgmd_gym.errors import shown, unknown_name
from lgmd_gym.openscenario.nodes import ConstraintError, Element, Node, parse_file

MAX_CELLS = 100_000
_NUMBERS = ("double", "int", "integer", "unsignedInt", "unsignedShort")
_OPERATORS: dict[str, Callable[[Any, Any], bool]] = {
    "equalTo": operator.eq,
    "greaterThan": operator.gt,
    "lessThan": operator.lt,
    "greaterOrEqual": operator.ge,
    "lessOrEqual": operator.le,
    "notEqualTo": operator.ne,
}
RULES = tuple(_OPERATORS)


class Assignment(NamedTuple):
    """A value given to a parameter, and the node that gives it."""

    value: str
    node: Node


def compare(value: str, rule: str, other: str) -> bool:
    """Return whether a rule holds between two values; numbers are compared as numbers."""
    try:
        return _OPERATORS[rule](float(value), float(other))
    except ValueError:
        if rule in ("equalTo", "notEqualTo"):
            return _OPERATORS[rule](value, other)
        raise ValueError(
            f"rule {rule} needs numbers, got {shown(value)} and {shown(other)}; use equalTo or notEqualTo"
        ) from None


def declare(parent: Element, given: Mapping[str, Assignment]) -> dict[str, str]:
    """Return the parameters that an element declares, with given values instead of the defaults.

    Returns:
        The scope of the parent with the declared parameters, in the order of the file.
    """
    scope, declared = dict(parent.scope), set[str]()
    declarations = parent.find("ParameterDeclarations")
    for item in () if declarations is None else declarations.all("ParameterDeclaration"):
        item = Element(item.node, scope)
        name = item.name_of("name")
        default = item.text("value")
        value, source = given.get(name, Assignment(default, item.node))
        kind = item.choice("parameterType", (*_NUMBERS, "string", "boolean", "dateTime"))
        _check_type(name, kind, value, source)
        scope[name] = value
        declared.add(name)
        _check_constraints(item, name, value, source)
    variables = parent.find("VariableDeclarations")
    for item in () if variables is None else variables.all("VariableDeclaration"):
        item = Element(item.node, scope)
        scope.setdefault(item.name_of("name"), item.text("value"))  # values at the start
        item.skip()
    for name in given.keys() - declared:
        raise given[name].node.error(str(unknown_name("parameter", name, declared)))
    return scope


def _check_type(name: str, kind: str, value: str, source: Node) -> None:
    if kind in _NUMBERS:
        try:
            number = float(value)
        except ValueError:
            raise source.error(
                f"parameter {name} of type {kind} must be a number, got {shown(value)}"
            ) from None
        if kind != "double" and not number.is_integer():
            raise source.error(f"parameter {name} of type {kind} must be a whole number, got {shown(value)}")
    elif kind == "boolean" and value not in ("true", "false", "0", "1"):
        raise source.error(f"parameter {name} must be true or false, got {shown(value)}")


def _check_constraints(item: Element, name: str, value: str, source: Node) -> None:
    """Check that all constraints of one of the groups hold."""
    groups = [list(group.all("ValueConstraint")) for group in item.all("ConstraintGroup")]
    texts: list[str] = []
    for group in groups:
        rules = [(entry.choice("rule", RULES), entry.text("value")) for entry in group]
        with item.locate_errors(f"parameter {name}: "):
            met = all(compare(value, rule, bound) for rule, bound in rules)
        if met:
            for other in item.all("ConstraintGroup"):
                other.skip()
            return
        texts.append(" and ".join(f"{rule} {bound}" for rule, bound in rules))
    if groups:
        text = f"parameter {name} must be {' or '.join(texts)}, got {shown(value)}"
        raise ConstraintError(str(source.error(text)))


def assignments(parent: Element) -> dict[str, Assignment]:
    """Return the `ParameterAssignments` of an element."""
    block = parent.find("ParameterAssignments")
    return {} if block is None else _assigned(block)


def _assigned(block: Element) -> dict[str, Assignment]:
    return {
        item.name_of("parameterRef"): Assignment(item.text("value"), item.node)
        for item in block.all("ParameterAssignment")
    }


def variations(distribution: Element) -> list[dict[str, Assignment]]:
    """Return the assignments of every cell of a `ParameterValueDistribution`.

    The cells are all combinations of the distributions; the first distribution varies slowest. A parameter
    that one `ParameterValueSet` of several leaves out keeps its value of the scenario.
    """
    block = distribution.child("Deterministic")
    axes, size, names = list[list[dict[str, Assignment]]](), 1, set[str]()
    for node in block.node.children:
        item = Element(node, block.scope)
        axis = _axis(item)
        size *= len(axis)
        if size > MAX_CELLS:
            raise item.error(f"the file has more than {MAX_CELLS} cells; use fewer values")
        own = {name for entry in axis for name in entry}
        for name in sorted(own & names):
            raise item.error(f"parameter {name} is varied twice; remove one distribution")
        names |= own
        axes.append(axis)
    return [{name: item for part in parts for name, item in part.items()} for parts in product(*axes)]


def _axis(item: Element) -> list[dict[str, Assignment]]:
    if item.tag == "DeterministicMultiParameterDistribution":
        axis = list(map(_assigned, item.only("ValueSetDistribution").all("ParameterValueSet")))
        if not axis:
            raise item.error("ValueSetDistribution must contain a ParameterValueSet")
        return axis
    if item.tag != "DeterministicSingleParameterDistribution":
        raise item.error(f"{item.tag} is not supported; use DeterministicSingleParameterDistribution")
    name = item.name_of("parameterName")
    values = item.only("DistributionSet", "DistributionRange")
    if values.tag == "DistributionSet":
        axis = [{name: Assignment(entry.text("value"), entry.node)} for entry in values.all("Element")]
    else:
        axis = [{name: Assignment(value, values.node)} for value in _range(values)]
    if not axis:
        raise item.error(f"the distribution of {name} has no value")
    return axis


def _range(values: Element) -> list[str]:
    """Return the values of a range, both limits included if the steps reach them."""
    step, limits = values.number("stepWidth"), values.child("Range")
    low, high = limits.number("lowerLimit"), limits.number("upperLimit")
    if step <= 0.0 or high < low:
        raise values.error(f"a range needs stepWidth > 0 and upperLimit >= lowerLimit, got {step:g}")
    steps = (high - low) / step
    if not steps < MAX_CELLS:
        raise values.error(f"a range must have at most {MAX_CELLS} values, got {steps:g}")
    count = floor(steps + 1e-9) + 1
    return [format(low + number * step, ".12g") for number in range(count)]


class Catalogs:
    """The catalogs of a scenario.

    Attributes:
        visited: Nodes of the entries that were read.
        notes: Folders that are relative to another one than that of the file.
    """

    def __init__(self, scenario: Element) -> None:
        self.visited: list[Node] = []
        self.notes: list[str] = []
        locations = scenario.find("CatalogLocations")
        self._missing = list[ValueError]()  # errors of folders that do not exist
        self._folders = [] if locations is None else self._existing(locations)

    def resolve(self, item: Element, *tags: str) -> Element:
        """Return an inline element with one of some tags, or the catalog entry that `item` refers to."""
        found = item.child(*tags, "CatalogReference")
        if found.tag != "CatalogReference":
            return Element(found.node, declare(found, {}))
        return self.entry(found, *tags)

    def node(self, reference: Element) -> Node | None:
        """Return the node of a `CatalogReference`; None if there is no such entry."""
        return self._entries.get((reference.text("catalogName"), reference.text("entryName")))

    def entry(self, reference: Element, *tags: str) -> Element:
        """Return the entry of a `CatalogReference`, with the assigned parameters."""
        catalog, name = reference.text("catalogName"), reference.text("entryName")
        entries = self._entries
        if (catalog, name) not in entries:
            catalogs = {known for known, _ in entries} or {folder.name for folder in self._folders}
            if catalog not in catalogs and self._missing:
                raise self._missing[0]
            if catalog not in catalogs:
                raise reference.error(str(unknown_name("catalog", catalog, catalogs)))
            names = {known for where, known in entries if where == catalog}
            raise reference.error(str(unknown_name(f"entry of catalog {catalog!r}", name, names)))
        node = entries[catalog, name]
        if node.tag not in tags:
            raise reference.error(f"entry {name!r} is a {node.tag}, not a {' or '.join(tags)}")
        self.visited.append(node)
        return Element(node, declare(Element(node, {}), assignments(reference)))

    def _existing(self, locations: Element) -> list[Path]:
        """Return the folders of the catalogs, or a file for a folder that is one without its suffix.

        One that does not exist is an error once it is needed.
        """
        folders: list[Path] = []
        for node in locations.node.children:
            directory = Element(node, locations.scope).child("Directory")
            folder, note = directory.path_nearby("path")
            if folder.is_dir():
                folders.append(folder)
                self.notes += [note] if note else []
            elif (file := folder.with_name(f"{folder.name}.xosc")).is_file():
                folders.append(file)
                self.notes.append(
                    str(directory.error(f"the catalog is the file {file.name!r}, not a folder"))
                )
            else:
                text = f"the folder {directory.text('path')!r} does not exist; check CatalogLocations"
                self._missing.append(directory.error(text))
        return list(dict.fromkeys(folders))

    @cached_property
    def _entries(self) -> dict[tuple[str, str], Node]:
        files = [
            path
            for folder in self._folders
            for path in (sorted(folder.glob("*.xosc")) if folder.is_dir() else [folder])
        ]
        return _entries_of(tuple(map(parse_file, files)))


@lru_cache(maxsize=32)
def _entries_of(files: tuple[Node, ...]) -> dict[tuple[str, str], Node]:
    """Return the entries of catalog files by catalog and name."""
    entries: dict[tuple[str, str], Node] = {}
    for file in files:
        for catalog in file.children:
            if catalog.tag == "Catalog":
                for node in catalog.children:
                    name = node.attributes.get("name", "")
                    entries[catalog.attributes.get("name", ""), name] = node
                    entries.setdefault((file.file.stem, name), node)  # as in esmini
    return entries
