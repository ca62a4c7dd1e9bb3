"""The rich console that the commands print to."""

from rich.console import Console


def make_console(width: int = 110) -> Console:
    """Return a console for stdout; files and pipes get a fixed width [columns]."""
    console = Console()
    return console if console.is_terminal else Console(width=width)
