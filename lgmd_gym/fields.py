"""Records of parameters: frozen dataclasses whose fields state default, bounds, unit and meaning once.

A field is declared in one place; checks, messages, documentation, the command line and the ranges of tuning
read that declaration.

Example:
    >>> @record
    ... class Mount(Record):
    ...     '''Position of a camera.'''
    ...
    ...     label = "mount"
    ...     height_m: float = number(1.2, "(0, 100]", "m", "Height above the ground.")
    >>> Mount(height_m=0.0)
    Traceback (most recent call last):
    ...
    ValueError: mount height_m must be in (0, 100] m, got 0.0
"""

import dataclasses
import inspect
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from typing import Any, ClassVar, Self, TypeAlias, TypeVar, cast, dataclass_transform

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.errors import (
    as_tuple,
    check_flag,
    check_keys,
    check_known,
    check_number,
    check_text,
    shown,
)

_NO_VALUE = object()  # no field has this value
_KEY = "lgmd_gym"  # of the declaration in the metadata of a dataclass field
_R = TypeVar("_R", bound=type)
Check: TypeAlias = Callable[[str, Any], Any]
"""Function of a name and a value that returns the checked value or raises ValueError."""
Field: TypeAlias = Any
"""A declared field, which stands for a value of the type that the class annotates."""


@dataclasses.dataclass(frozen=True, slots=True)
class Interval:
    """A range of numbers.

    Attributes:
        low: Lower end.
        high: Upper end; may be infinite.
        has_low: Whether the lower end belongs to the range.
        has_high: Whether the upper end belongs to the range.
    """

    low: float
    high: float
    has_low: bool = True
    has_high: bool = True

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the range of a text such as "(0, 100]" or "[0, inf]"."""
        low, high = (float(part) for part in text[1:-1].split(","))
        return cls(low, high, text[0] == "[", text[-1] == "]")

    def __contains__(self, value: float) -> bool:
        above = self.low <= value if self.has_low else self.low < value
        return above and (value <= self.high if self.has_high else value < self.high)

    def __str__(self) -> str:
        low = f"{'[' if self.has_low else '('}{self.low:.12g}"
        return f"{low}, {self.high:.12g}{']' if self.has_high else ')'}"


@dataclasses.dataclass(frozen=True, slots=True)
class Declaration:
    """What a field of a record may contain.

    Attributes:
        name: Name of the field; empty within the class body.
        default: Default value; `dataclasses.MISSING` for a field that must be given.
        check: Function of a name and a value that returns the checked value or raises ValueError.
        bounds: Range or choices, for documentation; empty for none.
        unit: Unit; empty for none.
        doc: Meaning, one sentence or more.
        interval: Range of a number; None for other kinds.
        search: Range that tuning searches; None for a field that is not tuned.
        group: Free label, for example of parameters that determine a rule's cameras.
    """

    name: str
    default: object
    check: Check
    bounds: str
    unit: str
    doc: str
    interval: Interval | None = None
    search: tuple[float, float] | None = None
    group: str = ""


def number(
    default: object,
    within: str,
    unit: str = "",
    doc: str = "",
    *,
    search: tuple[float, float] | None = None,
    group: str = "",
) -> Field:
    """Declare a float.

    Args:
        default: Default value.
        within: Range, for example "(0, 100]"; "[0, inf]" also allows infinity.
        unit: Unit.
        doc: Meaning.
        search: Range that tuning searches.
        group: See `Declaration`.
    """
    interval = Interval.parse(within)

    def check(name: str, value: object) -> float:
        return _check_interval(name, check_number(name, value), interval, unit, value)

    return _field(Declaration("", default, check, str(interval), unit, doc, interval, search, group))


def whole(
    default: object,
    within: str,
    unit: str = "",
    doc: str = "",
    *,
    search: tuple[float, float] | None = None,
    group: str = "",
) -> Field:
    """Declare an int; arguments as of `number`."""
    interval = Interval.parse(within)

    def check(name: str, value: object) -> int:
        given = check_number(name, value)
        if math.isinf(given) or given != int(given):
            raise ValueError(f"{name} must be a whole number in {interval}, got {shown(value)}")
        return int(_check_interval(name, given, interval, unit, value))

    return _field(Declaration("", default, check, str(interval), unit, doc, interval, search, group))


def numbers(default: tuple[float, ...], within: str, unit: str = "", doc: str = "") -> Field:
    """Declare a tuple of as many floats as the default has; further arguments as of `number`."""
    interval = Interval.parse(within)

    def check(name: str, value: object) -> tuple[float, ...]:
        items = as_tuple(value)
        if items is None or len(items) != len(default):
            raise ValueError(f"{name} must be {len(default)} numbers, got {shown(value)}")
        return tuple(_check_interval(name, check_number(name, x), interval, unit, x) for x in items)

    return _field(Declaration("", default, check, str(interval), unit, doc, interval))


def flag(default: object, doc: str = "") -> Field:
    """Declare a bool."""
    return _field(Declaration("", default, check_flag, "", "", doc))


def choice(default: object, names: Collection[str], doc: str = "") -> Field:
    """Declare one of some names."""

    def check(name: str, value: object) -> str:
        return check_known(name, value, names)

    return _field(Declaration("", default, check, ", ".join(map(repr, names)), "", doc))


def text(default: object, doc: str = "") -> Field:
    """Declare a string."""
    return _field(Declaration("", default, check_text, "", "", doc))


def value(default: object, check: Check, doc: str = "", bounds: str = "", unit: str = "") -> Field:
    """Declare a value with a check of its own, for example a nested record.

    Args:
        default: Default value.
        check: Function of a name and a value that returns the checked value or raises ValueError.
        doc: Meaning.
        bounds: Values in words, for documentation.
        unit: Unit.
    """
    return _field(Declaration("", default, check, bounds, unit, doc))


def optional(declared: Field) -> Field:
    """Allow None in a declared field, and make it the default."""
    declaration: Declaration = declared.metadata[_KEY]
    inner = declaration.check

    def check(name: str, value: object) -> object:
        return None if value is None else inner(name, value)

    bounds = f"{declaration.bounds}, or None" if declaration.bounds else ""
    return _field(dataclasses.replace(declaration, default=None, check=check, bounds=bounds))


@dataclass_transform(frozen_default=True, kw_only_default=True)
def record(cls: _R) -> _R:
    """Make a class a frozen dataclass, and add its declared fields to its docstring."""
    made = cast(_R, dataclasses.dataclass(frozen=True, slots=True, kw_only=True)(cast(type, cls)))
    lines = [f"    {item.name}: {_documentation(item)}" for item in declarations(made)]
    if lines and "Attributes:" not in (made.__doc__ or ""):
        made.__doc__ = "\n".join([inspect.cleandoc(made.__doc__ or ""), "", "Attributes:", *lines, ""])
    return made


class Record:
    """Base class of records, which checks every declared field.

    Attributes:
        label: Name of the record in error messages; empty for none.
    """

    __slots__ = ()
    label: ClassVar[str] = ""

    def __post_init__(self) -> None:
        """Check every declared field, then call `check`."""
        for name, label, check, default in _checks(type(self)):
            value = getattr(self, name)
            if value is not default:
                object.__setattr__(self, name, check(label, value))
        self.check()

    def check(self) -> None:
        """Raise ValueError for values that do not belong together; by default nothing is checked."""

    @classmethod
    def presets(cls) -> Mapping[str, Any]:
        """Return the records that `make` accepts by name, the default one first; none in this class."""
        return {}

    @classmethod
    def make(cls, value: Self | Mapping[str, object] | str | None = None, **changes: object) -> Self:
        """Return a record from an instance, a mapping of its fields, or a preset's name.

        Args:
            value: The record, some of its fields, the name of a preset, or None for the default. If the field
                `name` of a mapping is that of a preset, the other fields change the preset.
            changes: Fields to change on top.

        Raises:
            ValueError: For another type, an unknown preset or field, or a value out of range.
        """
        presets = cls.presets()
        if presets and (value is None or isinstance(value, str)):
            key = next(iter(presets)) if value is None else check_known(cls.label, value, presets)
            value = presets[key]
        elif presets and isinstance(value, Mapping):
            name = value.get("name")
            if isinstance(name, str) and name in presets:
                value, changes = presets[name], {**value, **changes}
        if isinstance(value, cls):
            if not changes:
                return value
            return cast(Self, dataclasses.replace(cast(Any, value), **cls._known(changes)))
        if value is not None and not isinstance(value, Mapping):
            names = "a name, " if presets else ""
            label = cls.label or cls.__name__
            raise ValueError(f"{label} must be {names}{cls.__name__} or Mapping, got {shown(value)}")
        given = {} if value is None else dict(value)
        return cls(**cls._known(given | changes))

    def to_dict(self) -> Values:
        """Return the fields as plain values; nested records become dicts and tuples become lists."""
        return {item.name: _plain(getattr(self, item.name)) for item in dataclasses.fields(cast(Any, self))}

    @classmethod
    def _known(cls, values: Mapping[str, object]) -> Values:
        known = [item.name for item in dataclasses.fields(cast(Any, cls))]
        check_keys(f"{cls.label or cls.__name__} field", values, known)
        return dict(values)


@cache
def declarations(cls: type) -> tuple[Declaration, ...]:
    """Return the declared fields of a record, in order."""
    return tuple(
        dataclasses.replace(item.metadata[_KEY], name=item.name)
        for item in dataclasses.fields(cast(Any, cls))
        if _KEY in item.metadata
    )


@cache
def _checks(cls: type[Record]) -> tuple[tuple[str, str, Check, object], ...]:
    """Return name, name in messages, check, and the default that needs no check of each declared field.

    The last is `_NO_VALUE` if there is no default, or if the check converts or refuses it.
    """
    found: list[tuple[str, str, Check, object]] = []
    for item in declarations(cls):
        label, default = f"{cls.label} {item.name}".lstrip(), item.default
        try:
            unchanged = default is not dataclasses.MISSING and item.check(label, default) is default
        except ValueError:
            unchanged = False
        found.append((item.name, label, item.check, default if unchanged else _NO_VALUE))
    return tuple(found)


def parse_options(kind: str, options: str, text: str) -> Arguments:
    """Split "option=value,option=value" into the options; numbers become int or float.

    Args:
        kind: What has the options, as in "agent", for error messages.
        options: The options.
        text: Text that contains them, for error messages.

    Raises:
        ValueError: For an option without a value, or one that occurs twice.

    Example:
        >>> parse_options("agent", "threshold=45,frames=2", "spike-threshold:threshold=45,frames=2")
        {'threshold': 45, 'frames': 2}
    """
    found: Arguments = {}
    for part in filter(None, options.split(",")):
        key, equals, given = part.partition("=")
        if not equals:
            raise ValueError(
                f"{kind} option {shown(part)} in {shown(text)} has no value; write {shown(key)[1:-1]}=VALUE"
            )
        if key.strip() in found:
            raise ValueError(f"{kind} option {shown(key.strip())} occurs twice in {shown(text)}; use it once")
        found[key.strip()] = _parse_value(given.strip())
    return found


def _parse_value(text: str) -> int | float | str:
    """Return an int or float if `text` is a number, else `text`."""
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            continue
    return text


def declaration_of(annotation: object) -> Declaration | None:
    """Return the declaration in an annotation such as `Annotated[float, number(...)]`; None without one."""
    for item in getattr(annotation, "__metadata__", ()):
        if isinstance(item, dataclasses.Field) and _KEY in item.metadata:
            return item.metadata[_KEY]
    return None


def _field(declaration: Declaration) -> Field:
    metadata = {_KEY: declaration}
    if declaration.default is dataclasses.MISSING:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=declaration.default, metadata=metadata)


def _check_interval(name: str, number: float, interval: Interval, unit: str, given: object) -> float:
    if math.isinf(number) and not (math.isinf(interval.high) and interval.has_high and number > 0):
        raise ValueError(f"{name} must be finite, got {shown(given)}")
    if number not in interval:
        raise ValueError(f"{name} must be in {interval}{f' {unit}' if unit else ''}, got {shown(given)}")
    return number


def _documentation(item: Declaration) -> str:
    """Return meaning, unit, range and default of a field in one line."""
    text = item.doc.rstrip(".")
    text += f" [{item.unit}]" if item.unit else ""
    text += f"; in {item.bounds}" if item.interval else f"; one of {item.bounds}" if item.bounds else ""
    default = item.default
    shown_default = f"{type(default).__name__}()" if isinstance(default, Record) else repr(default)
    return f"{text}; default {shown_default}." if item.default is not dataclasses.MISSING else f"{text}."


def _plain(value: object) -> object:
    if isinstance(value, Record):
        return value.to_dict()
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in cast(Sequence[object], value)]
    return value
