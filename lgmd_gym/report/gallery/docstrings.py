"""Parsed docstrings, for pages that are generated from code."""

import inspect
import re
from typing import Any, NamedTuple

from docstring_parser import DocstringStyle, parse


class DocumentedArgument(NamedTuple):
    """One argument in a docstring.

    Attributes:
        name: Name of the argument.
        default: Default value as code; empty without one.
        text: Description.
    """

    name: str
    default: str
    text: str


class ParsedDocstring(NamedTuple):
    """A Google-style docstring.

    Attributes:
        summary: The first line.
        text: Following paragraphs, in Markdown.
        arguments: Documented arguments in the order of the signature.
    """

    summary: str
    text: str
    arguments: tuple[DocumentedArgument, ...]


def parse_docstring(item: Any) -> ParsedDocstring:
    """Return the parsed docstring of a function or class.

    Raises:
        ValueError: If it has no docstring.
    """
    doc = inspect.getdoc(item)
    if not doc:
        raise ValueError(f"{item!r} has no docstring; write one")
    parsed = parse(doc, DocstringStyle.GOOGLE)
    texts = {param.arg_name: " ".join((param.description or "").split()) for param in parsed.params}
    arguments = [
        DocumentedArgument(name, _default(parameter), texts[name])
        for name, parameter in inspect.signature(item).parameters.items()
        if name in texts
    ]
    text = re.sub(r"^#+ *Arguments *$", "", parsed.long_description or "", flags=re.MULTILINE)
    return ParsedDocstring(parsed.short_description or "", text.strip(), tuple(arguments))


def _default(parameter: inspect.Parameter) -> str:
    """Return a default value as code, with floats shortened; empty without one."""
    value = parameter.default
    if value is inspect.Parameter.empty:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else repr(value)
