"""Options of `scenario`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from lgmd_gym.cli.options.values import File, Name, Names


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """Write, draw, check or export scenarios.

    lgmd-gym scenario new [FILE.toml] writes a commented scenario file to start from. lgmd-gym scenario show
    TARGET draws a scenario file, an OpenSCENARIO file, an environment id or a case from above at several
    times, with all speeds, as a picture. lgmd-gym scenario check PATH [PATH ...] plays every cell of
    OpenSCENARIO files and folders without braking, and prints one row per file: the cells, the contacts, and
    the largest deviations of impact location, impact speed and time from what the parameters and positions of
    the file state. lgmd-gym scenario export CASE --to FILE.xosc writes a case as OpenSCENARIO 1.3, and its
    road as OpenDRIVE next to it.
    """

    action: Positional[Literal["new", "show", "check", "export"]]
    """Write a template, draw a scenario, compare files, or export a case."""
    targets: Annotated[Positional[tuple[str, ...]], arg(metavar="FILE|PATH|CASE [PATH ...]")]
    """File to write (default: scenario.toml); scenario to draw; files and folders to compare; or the name of
    a case, for example quick/CCRs/v30."""
    to: File = None
    """Picture (.png, .svg; default: TARGET.png) or OpenSCENARIO file (.xosc) to write; must not exist."""
    force: bool = False
    """Replace an existing template or picture."""
    case: Name = None
    """Case to draw, of a file with several."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    trust: bool = False
    """Load the modules that the file names; they can run any code."""
    set: Annotated[tuple[str, ...], arg(metavar="NAME=NUMBER [...]")] = ()
    """Arguments of the scenario to draw, in SI units."""
    jobs: int = 2
    """Number of processes that compare files."""
