"""Help texts of the commands, from the docstrings of the options, wrapped at words to the terminal."""

import contextlib
import inspect
import io
import re
import shutil
import sys
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import docstring_parser
from tyro.conf import arg

_PLACEHOLDERS = {int: "N", float: "X", str: "NAME", tuple: "[NAME ...]"}
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def summary(cls: type) -> str:
    """Return the first line of the docstring of a command."""
    return (inspect.getdoc(cls) or "").splitlines()[0]


def description(cls: type) -> str:
    """Return the docstring of a command, one line per paragraph."""
    paragraphs = (inspect.getdoc(cls) or "").split("\n\n")
    return "\n\n".join(" ".join(text.split()) for text in paragraphs)


def documented(cls: Any) -> Any:
    """Return options as a class whose fields carry their help text and a readable placeholder.

    tyro would keep the line breaks of the docstrings, and name the types of the values.
    """
    texts = {item.arg_name: item.description or "" for item in docstring_parser.parse_from_object(cls).params}
    hints = get_type_hints(cls, include_extras=True)
    fields = {name: _documented(hint, texts[name]) for name, hint in hints.items()}
    defaults = {name: vars(cls)[name] for name in fields if name in vars(cls)}
    return dataclass(frozen=True, kw_only=True)(
        type(cls.__name__, (cls,), {"__annotations__": fields, **defaults})
    )


def _documented(hint: Any, text: str) -> Any:
    kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    given: dict[str, Any] = {"help": " ".join(text.split())}
    if (placeholder := _PLACEHOLDERS.get(get_origin(kind) or kind)) is not None:
        given["metavar"] = placeholder
    own = arg(**given, help_behavior_hint=_default_hint)
    return (
        Annotated[kind, own, *get_args(hint)[1:]] if get_origin(hint) is Annotated else Annotated[hint, own]
    )


def _default_hint(default: str) -> str:
    """Return the hint after a help text: none without a default, and for a switch that is off."""
    return {"": "", "None": "", "False": "", "True": "(default: on)"}.get(default, f"(default: {default})")


@contextlib.contextmanager
def wrapped_output() -> Iterator[None]:
    """Wrap at words what the block prints to stdout, to the width of the terminal; see `wrap`."""
    buffer = _Buffer()
    try:
        with contextlib.redirect_stdout(buffer):
            yield
    finally:
        sys.stdout.write(wrap(buffer.getvalue(), shutil.get_terminal_size().columns))


def wrap(text: str, width: int) -> str:
    """Return a text with its long lines wrapped; they continue below their text, or that of an example."""
    lines: list[str] = []
    for line in text.split("\n"):
        plain = re.sub(r"{[a-z,]{40,}}", "COMMAND", _COLOUR.sub("", line)).rstrip()
        if len(plain) <= width:
            lines.append(line if len(line) > len(_COLOUR.sub("", line)) else plain)
            continue
        head = re.match(r"usage: \S+ \S+ | *(\S+ )*\S+ {3,}| *", plain)
        indent = " " * (len(head[0]) if head and len(head[0]) < width // 2 else 4)
        lines += textwrap.wrap(
            plain, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
        )
    return "\n".join(lines)


class _Buffer(io.StringIO):
    """A buffer that is a terminal if stdout is one, so that the help has colours there."""

    def isatty(self) -> bool:
        return sys.__stdout__ is not None and sys.__stdout__.isatty()
