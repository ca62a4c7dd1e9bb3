"""Options of `tune`; attribute docstrings are the help texts."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Search the parameters of a rule on training levels of LGMD/RandomBraking-v0 and false-reaction cases.

    Validation levels choose between the defaults and the best trials; test levels and protocol suites are
    not used. A trial takes seconds for a latching rule with fixed sensors, because the sensor outputs are
    recorded once. It takes about a minute with --cameras, --camera-geometry or --neuron, and minutes for a
    rule that does not latch (graded).
    """

    agent: str = "stopping-zone"
    """Name of a rule."""
    cameras: tuple[str, ...] = ()
    """Camera presets to choose from, for a rule with one camera; for example fovea tele wide."""
    camera_geometry: bool = False
    """Also search the parameters that determine the rule's own cameras (stopping-zone: deceleration and
    reaction)."""
    neuron: tuple[str, ...] = ()
    """Neuron parameters to search, each from half to twice its default; for example sigma_3 t_sp."""
    trials: int = 40
    """Number of trials to add to the study."""
    levels: int = 100
    """Number of levels of each split; half of them are threats."""
    seeds: int = 1
    """Number of seeds of the false-reaction suite, from 1000 for trials and from 2000 for validation."""
    false_cost: float = 1.0
    """Cost of a false activation, relative to a contact at full speed."""
    jobs: int = 2
    """Number of processes."""
    study: Path = Path("tune.db")
    """SQLite file of the study; an existing study is resumed."""
    best: Path = Path("best.toml")
    """TOML file for the best parameters; must not exist. BEST-neuron.toml gets the neuron parameters."""
    sensitivity: bool = False
    """Print the sensitivity table (each parameter shifted by 20 % down and up) instead of searching."""
