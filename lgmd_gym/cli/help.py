"""Help texts of the commands, from the docstrings of the options, and one-line errors of the parser."""

import ast
import contextlib
import inspect
import io
import re
import shutil
import sys
import textwrap
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import docstring_parser
from tyro.conf import arg, subcommand

from lgmd_gym.aliases import Arguments
from lgmd_gym.errors import unknown_name

_PLACEHOLDERS: dict[object, str] = {int: "N", float: "X", str: "NAME", tuple: "[NAME ...]"}
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def summary(cls: type) -> str:
    """Return the first line of the docstring of a command."""
    return (inspect.getdoc(cls) or "").splitlines()[0]


def description(cls: type) -> str:
    """Return the docstring of a command, one line per paragraph."""
    paragraphs = (inspect.getdoc(cls) or "").split("\n\n")
    return "\n\n".join(" ".join(text.split()) for text in paragraphs)


def documented(cls: type) -> type:
    """Return options as a class whose fields carry their help text and a readable placeholder.

    tyro would keep the line breaks of the docstrings, and name the types of the values. A class with
    `SUBCOMMANDS` has the options of one of them as its field `command`.
    """
    if hasattr(cls, "SUBCOMMANDS"):
        return _with_subcommands(cls)
    texts = {item.arg_name: item.description or "" for item in docstring_parser.parse_from_object(cls).params}
    hints = get_type_hints(cls, include_extras=True)
    fields = {name: _documented(hint, texts[name]) for name, hint in hints.items()}
    defaults = {name: vars(cls)[name] for name in fields if name in vars(cls)}
    return dataclass(frozen=True, kw_only=True)(
        type(cls.__name__, (cls,), {"__annotations__": fields, **defaults})
    )


def _with_subcommands(cls: Any) -> type:
    """Return options whose field `command` has those of one subcommand."""
    commands = tuple(
        Annotated[documented(item), subcommand(name=name, description=description(item))]
        for name, item in cls.SUBCOMMANDS.items()
    )
    union = Union[commands]  # noqa: UP007  (built from a table)
    return dataclass(frozen=True, kw_only=True)(
        type(cls.__name__, (cls,), {"__annotations__": {"command": union}})
    )


def _documented(hint: object, text: str) -> Any:
    kind = get_args(hint)[0] if get_origin(hint) is Annotated else hint
    given: Arguments = {"help": " ".join(text.split())}
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
def wrapped_output() -> Generator[None, None, None]:
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


def one_line(box: str, command: str) -> str:
    """Return the message in the parser's box, with the nearest option of the command if the box has one."""
    lines = [line.strip("│╭╰╮╯|+ ") for line in re.sub(r"\x1b\[[0-9;]*m", "", box).splitlines()[1:]]
    text = " ".join("──" if re.fullmatch("[─-]+", line) else line for line in lines if line)
    text = re.sub(r" \(applied to [^)]*\)| Arguments are applied .* matter\.", "", text)
    message = re.split(r" ?──", text.removeprefix("── "))[0]
    for pattern, rewrite in _MESSAGES.items():
        if match := re.match(pattern, message):
            message = rewrite(match)
            break
    for suggestion in text.partition("Perhaps you meant:")[2].split(" --help"):
        option = re.search(rf"--[a-z-]+(?=.* in lgmd-gym {command}$)", suggestion)
        if option:
            return f"{message}; did you mean {option[0]}?"
    return message if message.endswith("?") else f"{message}; see lgmd-gym {command} --help"


def _unknown_choice(match: re.Match[str]) -> str:
    return str(unknown_name(f"value of {match[2]}", match[1], ast.literal_eval(match[3])))


# Messages of the parser and how to say them.
_MESSAGES: dict[str, Callable[[re.Match[str]], str]] = {
    r"Error parsing (--[a-z-]+):.*?('.*?')": lambda match: f"{match[1]} has the invalid value {match[2]}",
    r"invalid choice '(.*?)' for argument '(.*?)'\. Expected one of (\(.*?\))": _unknown_choice,
    r"Missing from lgmd-gym (\S+): (\S+)": lambda match: f"{match[1]} requires {match[2]}",
    r"Missing value for argument '(.*?)'": lambda match: f"{match[1]} requires a value",
    r"Unrecognized (?:or misplaced )?options: ([^,]*).*": lambda match: f"unknown option {match[1]}",
}
