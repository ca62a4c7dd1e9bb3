"""A report of sections with text, tables and figures, as Markdown, HTML, CSV and JSON."""

import base64
import csv
import json
import math
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple, cast

from lgmd_gym.aliases import Values
from lgmd_gym.processes.files import replace_file


class DataTable(NamedTuple):
    """A table whose cells are numbers or text.

    Attributes:
        name: Name of its CSV file, without suffix.
        columns: Headings, with units.
        rows: Cells; a number that is not finite is undefined.
        styles: Format of the numbers of each column, as in ".2f"; None for `.4g`.
        caption: Text below it; empty for none.
        hidden: Whether the table is only a file.
    """

    name: str
    columns: tuple[str, ...]
    rows: Sequence[Sequence[object]]
    styles: tuple[str, ...] | None = None
    caption: str = ""
    hidden: bool = False

    def texts(self) -> list[list[str]]:
        """Return the cells as text."""
        styles = self.styles or (".4g",) * len(self.columns)
        return [[_text(cell, style) for cell, style in zip(row, styles, strict=True)] for row in self.rows]


class Figure(NamedTuple):
    """A figure in a PNG or SVG file beside the report."""

    file: str  # relative to the report
    caption: str


class Section(NamedTuple):
    """A section of a report."""

    title: str
    text: str  # paragraphs, separated by empty lines
    items: tuple[DataTable | Figure, ...] = ()

    @property
    def shown(self) -> tuple[DataTable | Figure, ...]:
        """The items on the page."""
        return tuple(item for item in self.items if not (isinstance(item, DataTable) and item.hidden))


class Document(NamedTuple):
    """A report."""

    title: str
    text: str  # paragraphs before the first section
    sections: tuple[Section, ...]

    def write(self, folder: Path) -> None:
        """Write report.md, report.html, results.json, and one CSV file for each table, into a folder."""
        replace_file(folder / "report.md", self.markdown())
        replace_file(folder / "report.html", self.html(folder))
        tables = [item for section in self.sections for item in section.items if isinstance(item, DataTable)]
        values = {table.name: [_row(table, row) for row in table.rows] for table in tables}
        replace_file(folder / "results.json", json.dumps(values, indent=1) + "\n")
        for table in tables:
            with (folder / f"{table.name}.csv").open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(table.columns)
                writer.writerows(
                    [["" if (v := _plain(cell)) is None else v for cell in row] for row in table.rows]
                )

    def markdown(self) -> str:
        """Return the report as Markdown."""
        parts = [f"# {self.title}", self.text]
        for section in self.sections:
            parts += [f"## {section.title}", section.text]
            for item in section.shown:
                parts += [_markdown(item), item.caption]
        return "\n\n".join(part for part in parts if part) + "\n"

    def html(self, folder: Path) -> str:
        """Return the report as one page that contains the figures in a folder."""
        from jinja2 import Environment, PackageLoader, StrictUndefined

        environment = Environment(
            loader=PackageLoader("lgmd_gym.report", "."), autoescape=True, undefined=StrictUndefined
        )
        environment.filters |= {"code": _code, "picture": partial(_picture, folder)}
        template = environment.get_template("document.html")
        return template.render(document=self, paragraphs=_paragraphs, is_table=_is_table)


def _is_table(value: object) -> bool:
    return isinstance(value, DataTable)


def _picture(folder: Path, name: str) -> str:
    """Return a PNG or SVG file as a data URI."""
    kind = "svg+xml" if name.endswith(".svg") else "png"
    return f"data:image/{kind};base64,{base64.b64encode((folder / name).read_bytes()).decode()}"


def _code(text: str) -> str:
    """Return a text for HTML, with `names` in backticks as code."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))


def _paragraphs(value: str) -> list[str]:
    return [part for part in value.split("\n\n") if part]


def _markdown(item: DataTable | Figure) -> str:
    if isinstance(item, Figure):
        return f"![{item.caption}]({item.file})"
    numeric = [any(isinstance(row[k], int | float) for row in item.rows) for k in range(len(item.columns))]
    lines = [item.columns, ["---:" if is_number else "---" for is_number in numeric], *item.texts()]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def _text(cell: object, style: str) -> str:
    if cell is None or (isinstance(cell, float) and math.isnan(cell)):
        return "–"
    if isinstance(cell, bool | str):
        return str(cell)
    if isinstance(cell, float) and math.isinf(cell):
        return "∞"
    return format(cast(float, cell), "d" if isinstance(cell, int) else style)


def _plain(cell: object) -> object:
    """Return a cell for JSON and CSV; None for a number that is not finite."""
    if isinstance(cell, float):
        return round(cell, 6) if math.isfinite(cell) else None
    return cell


def _row(table: DataTable, row: Sequence[object]) -> Values:
    return {name: _plain(cell) for name, cell in zip(table.columns, row, strict=True)}
