"""XML files as nodes that know their file and line, and elements: nodes with the values of parameters.

The standard library's expat reports line numbers, so that no further package is needed.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.parsers import expat

from lgmd_gym.errors import shown, unknown_name
from lgmd_gym.openscenario.expressions import evaluate, format_value

MAX_BYTES = 20_000_000


class LocatedError(ValueError):
    """An error in a file; its message begins with the file and line."""


@dataclass(eq=False, slots=True)
class Node:
    """An XML element.

    Attributes:
        tag: Name.
        attributes: Attributes as in the file.
        file: File.
        line: Line of the start tag, from 1.
        children: Child nodes.
        used: Whether a reader has used the node.
        read: Names of the attributes that were used.
    """

    tag: str
    attributes: dict[str, str]
    file: Path
    line: int
    children: list["Node"] = field(default_factory=list)
    used: bool = False
    read: set[str] = field(default_factory=set)

    def error(self, message: str) -> LocatedError:
        """Return an error with the file and line."""
        return LocatedError(f"{self.file}:{self.line}: {message}")


def parse_file(path: Path) -> Node:
    """Return the root node of an XML file.

    Raises:
        ValueError: If the file cannot be read, is too large, is not XML, or declares a document type.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    if len(data) > MAX_BYTES:
        raise ValueError(f"{path} has {len(data)} bytes, more than {MAX_BYTES}; split the file")
    return _parse(path, data)


@lru_cache(maxsize=256)
def _parse(path: Path, data: bytes) -> Node:
    parser, open_nodes, roots = expat.ParserCreate(), list[Node](), list[Node]()

    def start(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag, attributes, path, parser.CurrentLineNumber)
        (open_nodes[-1].children if open_nodes else roots).append(node)
        open_nodes.append(node)

    def refuse(*_: Any) -> None:
        raise LocatedError(f"{path}:{parser.CurrentLineNumber}: a document type is not supported; remove it")

    parser.StartElementHandler, parser.EndElementHandler = start, lambda _: open_nodes.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise LocatedError(f"{path}:{error.lineno}: not XML: {expat.ErrorString(error.code)}") from None
    return roots[0]


@dataclass(frozen=True, slots=True)
class Element:
    """A node with the values of the parameters that apply to it.

    Attributes:
        node: The node.
        scope: Value of each parameter as text.
    """

    node: Node
    scope: dict[str, str]

    def __post_init__(self) -> None:
        self.node.used = True

    @property
    def tag(self) -> str:
        """Name of the XML element."""
        return self.node.tag

    def error(self, message: str) -> LocatedError:
        """Return an error with the file and line."""
        return self.node.error(message)

    def has(self, name: str) -> bool:
        """Return whether the element has an attribute."""
        return name in self.node.attributes

    def text(self, name: str, default: str | None = None) -> str:
        """Return an attribute with `$name` and `${...}` replaced by their values.

        Raises:
            ValueError: If it is missing and has no default, or if its expression is invalid.
        """
        self.node.read.add(name)
        raw = self.node.attributes.get(name)
        if raw is None:
            if default is None:
                raise self.error(f"{self.tag} needs the attribute {name!r}")
            return default
        return self.resolve(raw)

    def name_of(self, name: str) -> str:
        """Return an attribute with the name of a parameter, without its "$"."""
        raw = self.node.attributes.get(name)
        if raw is None:
            raise self.error(f"{self.tag} needs the attribute {name!r}")
        self.node.read.add(name)
        return raw.removeprefix("$")

    def resolve(self, raw: str) -> str:
        """Return a text with `$name` or `${...}` replaced by its value."""
        if raw.startswith("${") and raw.endswith("}"):
            try:
                return format_value(evaluate(raw[2:-1], self.scope))
            except ValueError as error:
                raise self.error(f"{self.tag}: {error}") from None
        if raw.startswith("$"):
            if raw[1:] not in self.scope:
                raise self.error(str(unknown_name("parameter", raw[1:], self.scope)))
            return self.scope[raw[1:]]
        return raw

    def number(self, name: str, default: float | None = None) -> float:
        """Return an attribute as a finite number."""
        text = self.text(name, None if default is None else repr(default))
        try:
            value = float(text)
        except ValueError:
            raise self.error(f"{self.tag} {name} must be a number, got {shown(text)}") from None
        if value != value or value in (float("inf"), float("-inf")):
            raise self.error(f"{self.tag} {name} must be finite, got {shown(text)}")
        return value

    def flag(self, name: str, default: bool = False) -> bool:
        """Return an attribute as a bool."""
        text = self.text(name, str(default).lower())
        if text not in ("true", "false", "0", "1"):
            raise self.error(f"{self.tag} {name} must be true or false, got {shown(text)}")
        return text in ("true", "1")

    def choice(self, name: str, known: tuple[str, ...], default: str | None = None) -> str:
        """Return an attribute that is one of some texts."""
        text = self.text(name, default)
        if text not in known:
            raise self.error(f"{self.tag} {name}={text!r} is not supported; use {' or '.join(known)}")
        return text

    def find(self, *tags: str) -> "Element | None":
        """Return the first child with one of some tags, or None."""
        for node in self.node.children:
            if node.tag in tags:
                return Element(node, self.scope)
        return None

    def child(self, *tags: str) -> "Element":
        """Return the first child with one of some tags.

        Raises:
            ValueError: If there is none; the message names an unsupported child.
        """
        found = self.find(*tags)
        if found is None:
            others = ", ".join(node.tag for node in self.node.children) or "nothing"
            raise self.error(f"{self.tag} must contain {' or '.join(tags)}, got {others}")
        return found

    def only(self, *tags: str) -> "Element":
        """Return the one child, which has one of some tags; an element with one alternative of several."""
        for node in self.node.children:
            if node.tag not in tags:
                raise node.error(f"{node.tag} in {self.tag} is not supported; use {' or '.join(tags)}")
        return self.child(*tags)

    def all(self, *tags: str) -> Iterator["Element"]:
        """Yield the children with some tags."""
        for node in self.node.children:
            if node.tag in tags:
                yield Element(node, self.scope)

    def skip(self) -> None:
        """Mark the element and everything in it as used: it has no effect."""
        _mark(self.node)


def _mark(node: Node) -> None:
    node.used = True
    node.read.update(node.attributes)
    for child in node.children:
        _mark(child)


def check_used(root: Node, ignored_tags: frozenset[str], ignored_attributes: frozenset[str]) -> None:
    """Raise ValueError for the first node or attribute that no reader has used.

    Args:
        root: Root of the tree.
        ignored_tags: Tags that have no effect, with all that they contain.
        ignored_attributes: Attributes without effect, as "name" or "Tag.name".
    """
    for node in root.children:
        if node.tag in ignored_tags:
            continue
        if not node.used:
            raise node.error(f"{node.tag} in {root.tag} is not supported; remove it")
        for name in node.attributes.keys() - node.read:
            if name not in ignored_attributes and f"{node.tag}.{name}" not in ignored_attributes:
                raise node.error(f"{node.tag} {name} is not supported; remove the attribute")
        check_used(node, ignored_tags, ignored_attributes)
