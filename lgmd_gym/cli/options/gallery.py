"""Options of `gallery`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from pathlib import Path

from lgmd_gym.cli.options.values import Names


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
