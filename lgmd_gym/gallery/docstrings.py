"""Docstrings as data: a lead, a text and arguments, for pages made from code."""

import inspect
import re
from typing import Any, NamedTuple

from docstring_parser import DocstringStyle, parse


class Argument(NamedTuple):
    """One argument of something documented.

    Attributes:
        name: Its name.
        default: Its default as code; empty if it has none.
        text: What the docstring says.
    """

    name: str
    default: str
    text: str


class About(NamedTuple):
    """What a docstring says.

    Attributes:
        lead: The first line.
        text: Paragraphs after it, Markdown.
        arguments: In the order of the signature.
    """

    lead: str
    text: str
    arguments: tuple[Argument, ...]


def read(item: Any) -> About:
    """Return what the Google-style docstring of a function or class says.

    Raises:
        ValueError: If there is none.
    """
    doc = inspect.getdoc(item)
    if not doc:
        raise ValueError(f"{item!r} has no docstring; write one")
    parsed = parse(doc, DocstringStyle.GOOGLE)
    texts = {given.arg_name: " ".join((given.description or "").split()) for given in parsed.params}
    arguments = [
        Argument(name, _default(parameter), texts[name])
        for name, parameter in inspect.signature(item).parameters.items()
        if name in texts
    ]
    text = re.sub(r"^#+ *Arguments *$", "", parsed.long_description or "", flags=re.MULTILINE)
    return About(parsed.short_description or "", text.strip(), tuple(arguments))


def _default(parameter: inspect.Parameter) -> str:
    """Return a default as it would be written, numbers shortened; empty if there is none."""
    value = parameter.default
    if value is inspect.Parameter.empty:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else repr(value)
