"""The rich console that the commands print to, and the message for a file that cannot be written."""

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console

from lgmd_gym.cli.fit import FittedTables

WIDTH = 80  # columns of a file or pipe


def make_console() -> Console:
    """Return a console for stdout that fits tables into its width.

    Files and pipes get the width in the variable COLUMNS, else that of `WIDTH` columns. The console prints
    text as it is: names of users may look like rich's markup or emoji codes.
    """
    console = Console(markup=False, emoji=False)
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console = Console(markup=False, emoji=False, width=WIDTH)
    console.push_render_hook(FittedTables(console))
    return console


@contextmanager
def activity(text: str) -> Iterator[Callable[[str], None]]:
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


def io_reason(error: OSError) -> str:
    """Return the path and the reason of an input or output error in one line."""
    paths = [str(path) for path in (error.filename, error.filename2) if path is not None]
    reason = error.strerror or " ".join(str(error).split()) or type(error).__name__
    return f"{' → '.join(map(repr, paths))}: {reason}" if paths else f"output failed: {reason}"


def drop_output() -> None:
    """Send what stdout still holds to nowhere if it cannot be written (full disk, closed pipe).

    Python would write it again at the end of the process and print a traceback.
    """
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
