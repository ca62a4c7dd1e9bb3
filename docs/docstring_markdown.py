"""Parts of docstrings as Markdown: sections, tables and fields."""

import inspect
import re
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, fields
from typing import Any

from docstring_parser import DocstringStyle, parse

ARGS = re.compile(r"^(Args|Raises|Attributes|Example):$", re.MULTILINE)


def sections(item: Any) -> dict[str, str]:
    """Return the text below each `## heading` of a docstring in Markdown, without Google-style sections."""
    parts = re.split(r"^## +(.*)$", inspect.getdoc(item) or "", flags=re.MULTILINE)
    return {
        heading.strip(): ARGS.split(text)[0].strip()
        for heading, text in zip(parts[1::2], parts[2::2], strict=True)
    }


def as_markdown(item: Any) -> str:
    """Return a docstring with its Args, Raises and Attributes as Markdown lists."""
    lines: list[str] = []
    in_section = False
    for line in (inspect.getdoc(item) or "").splitlines():
        if re.match(r"^(Args|Raises|Attributes):$", line):
            in_section = True
            lines += ["", "" if line == "Args:" else f"**{line}**", ""]
        elif in_section and (entry := re.match(r"^    (\w+): (.*)", line)):
            lines.append(f"- `{entry[1]}`: {entry[2]}")
        elif in_section and line.startswith("     "):
            lines.append(f"  {line.strip()}")
        else:
            in_section = in_section and not line.strip()
            lines.append(line)
    return "\n".join(lines)


def markdown_rows(text: str) -> list[list[str]]:
    """Return the cells of all Markdown tables in a text, without their headings."""
    lines = [line.strip() for line in text.splitlines() if line.strip().startswith("|")]
    rows = [[cell.strip() for cell in line[1:].removesuffix("|").split("|")] for line in lines]
    rules = [index for index, row in enumerate(rows) if set("".join(row)) <= set("-: ")]
    headings = {index for rule in rules for index in (rule - 1, rule)}
    return [row for index, row in enumerate(rows) if index not in headings]


def rst_rows(item: Any) -> list[list[str]]:
    """Return the cells of all simple reStructuredText tables in a docstring, without their headings."""
    rows: list[list[str]] = []
    bounds: list[tuple[int, int | None]] = []
    rules = 0
    for line in (inspect.getdoc(item) or "").splitlines():
        if re.fullmatch(r"=+( +=+)+", line):
            rules += 1
            starts = [match.start() for match in re.finditer("=+", line)]
            bounds = list(zip(starts, [*starts[1:], None], strict=True))
        elif rules % 3 == 2:  # between the rule below the headings and the last one
            cells = [line[start:end].strip() for start, end in bounds]
            if cells[0]:
                rows.append(cells)
            else:
                rows[-1] = [" ".join(pair).strip() for pair in zip(rows[-1], cells, strict=True)]
    return [[cell.replace("``", "`") for cell in row] for row in rows]


def argument_texts(item: Any) -> dict[str, str]:
    """Return the descriptions of the arguments or attributes of a docstring by name."""
    parsed = parse(inspect.getdoc(item) or "", DocstringStyle.GOOGLE)
    return {param.arg_name: " ".join((param.description or "").split()) for param in parsed.params}


def table(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [list(headings), ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(str(cell) for cell in line)} |" for line in lines)


def fields_table(cls: Any) -> str:
    """Return the fields of a documented dataclass with their defaults as a Markdown table."""
    texts = argument_texts(cls)
    return table(
        ("field", "default", "meaning"),
        ((f"`{item.name}`", _default(item), texts[item.name]) for item in fields(cls)),
    )


def _default(item: Any) -> str:
    if item.default_factory is not MISSING:
        value = item.default_factory()
        return f"`{type(value).__name__}()`" if value != () else "`()`"
    if item.default is MISSING:
        return "–"
    return f"`{item.default:.4g}`" if isinstance(item.default, float) else f"`{item.default!r}`"
