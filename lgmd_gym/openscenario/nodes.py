"""XML files as nodes that know their file and line, and elements: nodes with the values of parameters.

The standard library's expat reports line numbers, so that no further package is needed.
"""

import math
import re
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from xml.parsers import expat

from lgmd_gym.errors import shown, unknown_name
from lgmd_gym.processes.inputs import read_bytes

Value = float | bool
MAX_LENGTH = 5000  # characters
MAX_DEPTH = 100  # of nested groups
_TOKEN = re.compile(
    r"\s*(\$\{?\w+\}?|\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?|[A-Za-z_]\w*|[-+*/%(),])"
)
CONSTANTS: dict[str, Value] = {"pi": math.pi, "PI": math.pi, "e": math.e, "true": True, "false": False}


def _round(value: float) -> float:
    """Round half away from zero, as in the standard's reference language."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


def _sign(value: float) -> float:
    return float((value > 0.0) - (value < 0.0))


def _floor(value: float) -> float:
    return float(math.floor(value))


def _ceil(value: float) -> float:
    return float(math.ceil(value))


_FUNCTIONS: dict[str, tuple[int, Callable[..., float]]] = {
    "round": (1, _round),
    "floor": (1, _floor),
    "ceil": (1, _ceil),
    "sqrt": (1, math.sqrt),
    "pow": (2, math.pow),
    "sin": (1, math.sin),
    "cos": (1, math.cos),
    "tan": (1, math.tan),
    "asin": (1, math.asin),
    "acos": (1, math.acos),
    "atan": (1, math.atan),
    "sign": (1, _sign),
    "abs": (1, math.fabs),
    "max": (2, max),
    "min": (2, min),
}


def evaluate(text: str, parameters: Mapping[str, str]) -> Value:
    """Return the value of an expression.

    Args:
        text: The expression, without `${` and `}`.
        parameters: Values of the parameters as text.

    Raises:
        ValueError: If the expression is not valid, or its value is undefined or infinite.
    """
    if len(text) > MAX_LENGTH:
        raise ValueError(f"an expression must have at most {MAX_LENGTH} characters, got {len(text)}")
    try:
        value = _Parser(_tokens(text), parameters).parse()
    except (ZeroDivisionError, OverflowError) as error:
        raise ValueError(f"expression {shown(text)} has no value: {error}") from None
    except ValueError as error:
        raise ValueError(f"expression {shown(text)}: {error}") from None
    if not isinstance(value, bool) and not math.isfinite(value):
        raise ValueError(f"expression {shown(text)} has the value {value}")
    return value


def format_value(value: Value) -> str:
    """Return a value as text; whole numbers without a decimal point."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))


def _tokens(text: str) -> list[str]:
    tokens, position = list[str](), 0
    end = len(text.rstrip())
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            raise ValueError(f"cannot read {shown(text[position:])}")
        tokens.append(match[1])
        position = match.end()
    return tokens


class _Parser:
    """Recursive descent over the tokens of an expression."""

    def __init__(self, tokens: list[str], parameters: Mapping[str, str]) -> None:
        self._tokens, self._parameters = tokens, parameters
        self._next, self._depth = 0, 0

    def parse(self) -> Value:
        value = self._or()
        if self._next < len(self._tokens):
            raise ValueError(f"unexpected {self._peek()!r}")
        return value

    def _peek(self) -> str:
        return self._tokens[self._next] if self._next < len(self._tokens) else ""

    def _take(self, *tokens: str) -> str:
        """Return the next token and advance, if it is one of some; else an empty text."""
        token = self._peek()
        if token and token in tokens:
            self._next += 1
            return token
        return ""

    def _expect(self, token: str) -> None:
        if not self._take(token):
            raise ValueError(f"expected {token!r}, got {self._peek() or 'the end'!r}")

    def _or(self) -> Value:
        value = self._and()
        while self._take("or"):
            other = _as_bool(self._and())
            value = _as_bool(value) or other
        return value

    def _and(self) -> Value:
        value = self._not()
        while self._take("and"):
            other = _as_bool(self._not())
            value = _as_bool(value) and other
        return value

    def _not(self) -> Value:
        return not _as_bool(self._deeper(self._not)) if self._take("not") else self._sum()

    def _sum(self) -> Value:
        value = self._product()
        while operator := self._take("+", "-"):
            other = _as_number(self._product())
            value = _as_number(value) + (other if operator == "+" else -other)
        return value

    def _product(self) -> Value:
        value = self._unary()
        while operator := self._take("*", "/", "%"):
            other, number = _as_number(self._unary()), _as_number(value)
            if operator == "*":
                value = number * other
            else:
                value = number / other if operator == "/" else math.fmod(number, other)
        return value

    def _unary(self) -> Value:
        if self._take("-"):
            return -_as_number(self._deeper(self._unary))
        return _as_number(self._deeper(self._unary)) if self._take("+") else self._atom()

    def _atom(self) -> Value:
        if self._take("("):
            value = self._deeper(self._or)
            self._expect(")")
            return value
        token = self._peek()
        if not token or token in "+-*/%),":
            raise ValueError(f"expected a value, got {token or 'the end'!r}")
        self._next += 1
        if token.startswith("$"):
            return self._parameter(token.strip("${}"))
        if token[0].isdigit() or token[0] == ".":
            return float(token)
        if self._peek() == "(":
            return self._call(token)
        if token not in CONSTANTS:
            raise unknown_name("constant", token, CONSTANTS)
        return CONSTANTS[token]

    def _call(self, name: str) -> float:
        if name not in _FUNCTIONS:
            raise unknown_name("function", name, _FUNCTIONS)
        count, function = _FUNCTIONS[name]
        self._expect("(")
        values = [_as_number(self._deeper(self._or))]
        while self._take(","):
            values.append(_as_number(self._deeper(self._or)))
        self._expect(")")
        if len(values) != count:
            raise ValueError(f"{name} takes {count} values, got {len(values)}")
        try:
            return float(function(*values))
        except ValueError:
            raise ValueError(
                f"{name}({', '.join(f'{value:g}' for value in values)}) is not defined"
            ) from None

    def _parameter(self, name: str) -> Value:
        if name not in self._parameters:
            raise unknown_name("parameter", name, self._parameters)
        text = self._parameters[name]
        if text in ("true", "false"):
            return text == "true"
        try:
            return float(text)
        except ValueError:
            raise ValueError(f"parameter {name} must be a number, got {shown(text)}") from None

    def _deeper(self, rule: Callable[[], Value]) -> Value:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ValueError(f"more than {MAX_DEPTH} nested groups")
        value = rule()
        self._depth -= 1
        return value


def _as_number(value: Value) -> float:
    if isinstance(value, bool):
        raise ValueError(f"expected a number, got {str(value).lower()}")
    return value


def _as_bool(value: Value) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"expected true or false, got {value:g}")
    return value


MAX_LEVELS = 200  # of elements within elements


class LocatedError(ValueError):
    """An error in a file; its message begins with the file and line."""


class ConstraintError(LocatedError):
    """A value that violates the constraints of its parameter."""


@dataclass(eq=False, slots=True)
class Node:
    """An XML element."""

    tag: str  # name
    attributes: dict[str, str]  # attributes as in the file
    file: Path
    line: int  # line of the start tag, from 1
    children: list["Node"] = field(default_factory=list["Node"])  # child nodes
    used: bool = False  # whether a reader has used the node
    read: set[str] = field(default_factory=set[str])  # names of the attributes that were used

    def error(self, message: str) -> LocatedError:
        """Return an error with the file and line."""
        return LocatedError(f"{self.file}:{self.line}: {message}")


def parse_file(path: Path) -> Node:
    """Return the root node of an XML file.

    Raises:
        ValueError: If the file cannot be read, is too large, is not XML, or declares a document type.
    """
    try:
        data = read_bytes(path)
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    return _parse(path, data)


@lru_cache(maxsize=256)
def _parse(path: Path, data: bytes) -> Node:
    parser, open_nodes, roots = expat.ParserCreate(), list[Node](), list[Node]()

    def start(tag: str, attributes: dict[str, str]) -> None:
        node = Node(tag, attributes, path, parser.CurrentLineNumber)
        if len(open_nodes) == MAX_LEVELS:
            raise node.error(f"{tag} is within more than {MAX_LEVELS} elements; remove levels")
        (open_nodes[-1].children if open_nodes else roots).append(node)
        open_nodes.append(node)

    def refuse(*_: object) -> None:
        raise LocatedError(f"{path}:{parser.CurrentLineNumber}: a document type is not supported; remove it")

    parser.StartElementHandler, parser.EndElementHandler = start, lambda _: open_nodes.pop()
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise LocatedError(f"{path}:{error.lineno}: not XML: {expat.ErrorString(error.code)}") from None
    except (LookupError, ValueError) as error:  # of an encoding that Python does not have, or of many bytes
        if isinstance(error, LocatedError):
            raise
        raise LocatedError(f"{path}:1: the encoding cannot be read ({error}); save it as UTF-8") from None
    return roots[0]


@dataclass(frozen=True, slots=True)
class Element:
    """A node with the values of the parameters that apply to it."""

    node: Node
    scope: dict[str, str]  # value of each parameter as text

    def __post_init__(self) -> None:
        self.node.used = True

    @property
    def tag(self) -> str:
        """Name of the XML element."""
        return self.node.tag

    def error(self, message: str) -> LocatedError:
        """Return an error with the file and line."""
        return self.node.error(message)

    @contextmanager
    def locate_errors(self, prefix: str = "") -> Generator[None, None, None]:
        """Add a prefix, the file and the line to a ValueError of the block; a located one stays as it is.

        A number that is too large or small for the arithmetic becomes a ValueError as well.
        """
        try:
            yield
        except LocatedError:
            raise
        except ValueError as error:
            raise self.error(f"{prefix}{error}") from None
        except ArithmeticError as error:
            raise self.error(f"{prefix}a number is too large or too small ({error})") from None

    def has(self, name: str) -> bool:
        """Return whether the element has an attribute."""
        return name in self.node.attributes

    def text(self, name: str, default: str | None = None) -> str:
        """Return an attribute with `$name` and `${...}` replaced by their values."""
        if default is not None and not self.has(name):
            return default
        return self.resolve(self._raw(name))

    def path(self, name: str) -> Path:
        """Return an attribute with a path relative to the folder of the file; a backslash separates too."""
        return self.node.file.parent / self.text(name).replace("\\", "/")

    def path_nearby(self, name: str) -> tuple[Path, str]:
        """Return `path`, or the same path relative to the nearest folder above the file if only that exists.

        Simulators have folders of their own from which they read paths, and the files of others rely on them.

        Returns:
            The path, and a note with file and line if it is relative to a folder above, else "".
        """
        path, text = self.path(name), self.text(name).replace("\\", "/")
        if path.exists():
            return path, ""
        for folder in self.node.file.absolute().parents[1:]:
            if (folder / text).exists():
                return folder / text, str(
                    self.error(f"{text!r} is relative to {str(folder)!r}, not to the folder of the file")
                )
        return path, ""

    def label(self, name: str = "name") -> str:
        """Return an attribute that is a name, as in the file if it is no expression with a value."""
        try:
            return self.text(name)
        except ValueError:
            return self._raw(name)

    def name_of(self, name: str) -> str:
        """Return an attribute with the name of a parameter, without its "$"."""
        return self._raw(name).removeprefix("$")

    def _raw(self, name: str) -> str:
        """Return an attribute as in the file."""
        if not self.has(name):
            raise self.error(f"{self.tag} needs the attribute {name!r}")
        self.node.read.add(name)
        return self.node.attributes[name]

    def resolve(self, raw: str) -> str:
        """Return a text with `$name` or `${...}` replaced by its value."""
        if raw.startswith("${") and raw.endswith("}"):
            with self.locate_errors(f"{self.tag}: "):
                return format_value(evaluate(raw[2:-1], self.scope))
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
        if not math.isfinite(value):
            raise self.error(f"{self.tag} {name} must be finite, got {shown(text)}")
        return value

    def whole(self, name: str, default: int | None = None) -> int:
        """Return an attribute as a whole number."""
        value = self.number(name, None if default is None else float(default))
        if not value.is_integer():
            raise self.error(f"{self.tag} {name} must be a whole number, got {shown(self.text(name))}")
        return int(value)

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
        """Return the first child with one of some tags."""
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

    def properties(self) -> dict[str, str]:
        """Return the values in the child `Properties` by name."""
        block = self.find("Properties")
        items = () if block is None else block.all("Property")
        return {item.text("name"): item.text("value") for item in items}

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
