"""The rich console of the commands, tables that fit its width, and errors of writing."""

import io
import os
import sys
import warnings
from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console, ConsoleRenderable, RenderHook
from rich.table import Column, Table
from rich.text import Text

from lgmd_gym.errors import InputNote

WIDTH = 80  # columns of a file or pipe
GAP = 2  # columns of the terminal between two columns of a table
FOLD_WIDTH = 22  # a longer word in a column with overflow "fold" may be broken
MAX_LINES = 8  # height of a cell that is reduced by wider columns


def make_console() -> Console:
    """Return a console for stdout that fits tables into its width.

    Files and pipes get the width in the variable COLUMNS, else that of `WIDTH` columns. The console prints
    text as it is: names of users may look like rich's markup or emoji codes.
    """
    console = Console(markup=False, emoji=False)
    columns = os.environ.get("COLUMNS", "")
    if console.width < 1 or (not console.is_terminal and not (columns.isdecimal() and int(columns) > 0)):
        console = Console(markup=False, emoji=False, width=WIDTH)
    console.push_render_hook(FittedTables(console))
    return console


@contextmanager
def activity(text: str) -> Generator[Callable[[str], None], None, None]:
    """Show a text with a spinner if stderr is a terminal; yield the function that replaces the text.

    The text is erased in the end. Output to stdout that is not a terminal stays there.
    """
    from rich.progress import Progress, SpinnerColumn, TextColumn

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False))
    console, redirect = Console(stderr=True), sys.stdout.isatty()
    if not console.is_terminal:
        yield lambda new: None
        return
    with Progress(*columns, console=console, transient=True, redirect_stdout=redirect) as progress:
        task = progress.add_task(text)
        yield lambda new: progress.update(task, description=new)


def note(text: str) -> None:
    """Print a line to stderr."""
    print(f"lgmd-gym: {text}", file=sys.stderr)


@contextmanager
def printed_notes() -> Generator[None, None, None]:
    """Print each `InputNote` of the block once, as one line to stderr."""
    with warnings.catch_warnings():
        warnings.simplefilter("default", InputNote)
        show = warnings.showwarning

        def shown(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if issubclass(category, InputNote):
                note(str(message))
            else:
                show(message, category, *place, **more)

        warnings.showwarning = shown
        yield


def io_reason(error: OSError) -> str:
    """Return the path and the reason of an input or output error in one line."""
    paths = [str(path) for path in (error.filename, error.filename2) if path is not None]
    reason = error.strerror or " ".join(str(error).split()) or type(error).__name__
    return f"{' → '.join(map(repr, paths))}: {reason}" if paths else f"output failed: {reason}"


def prepare_streams() -> None:
    """Make stdout and stderr take every text: characters that their encoding lacks become "?".

    A stream that was closed before the start is discarded.
    """
    for name in ("stdout", "stderr"):
        stream: Any = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115
        elif isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def drop_output() -> None:
    """Discard buffered stdout that cannot be written (full disk, closed pipe).

    Python would write it again at the end of the process and print a traceback.
    """
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


class FittedTables(RenderHook):
    """Replace every table that a console prints by the parts that `fit` returns."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        """Return the renderables with fitted tables."""
        fitted: list[ConsoleRenderable] = []
        for item in renderables:
            fitted += fit(item, self._console) if isinstance(item, Table) else [item]
        return fitted


def fit(table: Table, console: Console) -> list[ConsoleRenderable]:
    """Return the title, the table as one or more tables no wider than a console, and the caption.

    No text is left out. Cells are wrapped at words, with widths that give the lowest rows. A table with too
    many columns for that is divided into parts, each with the leading columns of text and as many of the
    others as fit.
    """
    widths = [_word_width(column) for column in table.columns]
    if _total(widths) > console.width:
        limits = [FOLD_WIDTH if column.overflow == "fold" else console.width for column in table.columns]
        widths = list(map(min, widths, limits))
    fitted: list[ConsoleRenderable] = [] if table.title is None else [_line(table.title, "table.title")]
    for number, indices in enumerate(_divide(table, widths, console.width)):
        fitted += [Text()] if number else []
        columns = [table.columns[index] for index in indices]
        fitted.append(_part(table, columns, _widen(columns, [widths[index] for index in indices], console)))
    return [*fitted, _line(f"{table.caption}\n" if table.caption else "", "table.caption")]


def _line(text: object, style: str) -> Text:
    return text if isinstance(text, Text) else Text(str(text), style)


def _total(widths: list[int]) -> int:
    """Return the width of a table."""
    return sum(widths) + GAP * (len(widths) - 1)


def _divide(table: Table, widths: list[int], available: int) -> list[list[int]]:
    """Return the indices of the columns of each part."""
    if _total(widths) <= available:
        return [list(range(len(widths)))]
    keys = 1
    while keys < len(widths) - 1 and table.columns[keys].justify != "right":
        keys += 1
    if keys > 1 and _total(widths[: keys + 1]) > available:
        keys = 1
    leading = list(range(keys))
    parts = [[*leading]]
    for index in range(keys, len(widths)):
        if len(parts[-1]) > keys and _total([widths[i] for i in [*parts[-1], index]]) > available:
            parts.append([*leading])
        parts[-1].append(index)
    return parts


def _widen(columns: list[Column], widths: list[int], console: Console) -> list[int]:
    """Return the widths with which the rows have the fewest lines, then wider text and headings."""
    for lines in range(1, MAX_LINES + 1):
        needed = [
            _width_for(column, width, lines, console) for column, width in zip(columns, widths, strict=True)
        ]
        if _total(needed) <= console.width:
            widths = needed
            break
    rest = console.width - _total(widths)
    if rest < 0:  # of a part with the fewest columns: words of the widest one are broken, but names last
        index = max(range(len(widths)), key=lambda i: (i > 0, widths[i]))
        widths[index] = max(widths[index] + rest, 1)
    for index, column in enumerate(columns):
        texts = [Text(str(column.header)), *(_texts(column) if column.justify != "right" else [])]
        wider = min(max(_line_width(texts), widths[index]), widths[index] + max(rest, 0))
        widths[index], rest = wider, rest - (wider - widths[index])
    return widths


def _width_for(column: Column, low: int, lines: int, console: Console) -> int:
    """Return the smallest width from `low` on with which no cell has more lines, save its own line breaks."""
    header = Text(str(column.header))
    high = max(_line_width([header, *_texts(column)]), low)
    texts = [text for text in [header, *_texts(column)] if text.cell_len > low]

    def enough(width: int) -> bool:
        return all(len(text.wrap(console, width)) <= max(lines, text.plain.count("\n") + 1) for text in texts)

    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle) else (middle + 1, high)
    return low


def _texts(column: Column) -> list[Text]:
    """Return the different cells of a column."""
    texts = [cell if isinstance(cell, Text) else Text(str(cell)) for cell in column.cells]
    return list({text.plain: text for text in texts}.values())


def _line_width(texts: Iterable[Text]) -> int:
    """Return the width of the longest line of some cells."""
    lines = [line for text in texts for line in text.plain.split("\n")]
    return max((Text(line).cell_len for line in lines), default=0)


def _word_width(column: Column) -> int:
    """Return the width of the longest word of the heading and the cells."""
    texts = [Text(str(column.header)), *_texts(column)]
    words = [word for text in texts for word in text.plain.split()]
    return max([Text(word).cell_len for word in words] + [column.min_width or 1])


def _part(table: Table, columns: list[Column], widths: list[int]) -> Table:
    """Return a table with some of the columns, without title and caption."""
    part = copy(table)
    part.title = part.caption = None
    part.expand = part.show_edge = part.pad_edge = False
    part.box, part.padding = SIMPLE_HEAD, (0, 1, 0, 0)
    part.columns = [
        replace(column, width=width, overflow="fold", ratio=None, min_width=None, _index=number)
        for number, (column, width) in enumerate(zip(columns, widths, strict=True))
    ]
    return part
