"""The `gallery` command; the attribute docstrings of `Gallery` are its help texts."""

from dataclasses import dataclass
from pathlib import Path

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import Names


@dataclass(frozen=True, kw_only=True)
class Gallery:
    """Write an HTML page with a video of every scenario and the results of the agents; takes minutes.

    The folder contains index.html, which needs no network connection.
    """

    out: Path = Path("gallery")
    """Folder; must not exist."""
    families: Names = None
    """Scenario families or kinds of traffic, for example CCRs merge. Default: all."""
    agent: str = "spike-threshold"
    """Agent in the videos."""
    seeds: int = 3
    """Number of seeds per scenario for the results."""


def run(options: Gallery) -> int:
    """Write the gallery and print its path."""
    from lgmd_gym.report.gallery.build import make_gallery

    names = options.families or ()
    page = make_gallery(options.out, names, options.agent, options.seeds, make_console().print)
    print(f"gallery: {page}")
    return 0
