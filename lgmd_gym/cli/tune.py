"""The `tune` command; the attribute docstrings of `Tune` are its help texts."""

import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.table import Table

from lgmd_gym.cli.console import make_console

if TYPE_CHECKING:
    from lgmd_gym.tuning.objective import Objective
    from lgmd_gym.tuning.space import Proposal, SearchSpace


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Search the parameters of a rule on training levels of LGMD/RandomBraking-v0 and false-reaction cases.

    Validation levels choose between the defaults and the best trials; test levels and protocol suites are
    not used. A trial takes seconds with fixed sensors, because the sensor outputs are recorded once, and
    about a minute with --cameras, --camera-geometry or --neuron.
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


def run(options: Tune) -> int:
    """Search the parameters and write them, or print the sensitivity table; return 0, or 130 for Ctrl-C."""
    from lgmd_gym.processes.files import check_new_file
    from lgmd_gym.tuning.objective import Objective
    from lgmd_gym.tuning.search import tune
    from lgmd_gym.tuning.space import SearchSpace

    space = SearchSpace(
        agent=options.agent,
        cameras=options.cameras,
        camera_geometry=options.camera_geometry,
        neuron=options.neuron,
    )
    _check(options)
    console = make_console()
    validation = Objective("validation", options.levels, options.seeds, options.jobs)
    if options.sensitivity:
        console.print(_sensitivity_table(space, validation))
        return 0
    for path in (options.best, _neuron_file(options.best)):
        check_new_file(path, "--best")
    train = Objective("train", options.levels, options.seeds, options.jobs)
    log = partial(console.print, soft_wrap=True)
    try:
        best = tune(space, options.study, options.trials, train, validation, options.false_cost, log=log)
    except KeyboardInterrupt:
        print(f"interrupted; to resume, repeat the command with --study {options.study}", file=sys.stderr)
        return 130
    arguments = _save(options.agent, best, options.best)
    console.print(f"options of lgmd-gym bench for the best parameters: {arguments}", soft_wrap=True)
    return 0


def _check(options: Tune) -> None:
    for name, low in (("trials", 1), ("levels", 1), ("seeds", 0), ("jobs", 1)):
        if getattr(options, name) < low:
            raise ValueError(f"{name} must be >= {low}, got {getattr(options, name)!r}")
    if not options.false_cost > 0.0:
        raise ValueError(f"false_cost must be > 0, got {options.false_cost!r}")


def _neuron_file(best: Path) -> Path:
    """Return the path of the file for the neuron parameters."""
    return best.with_name(f"{best.stem}-neuron{best.suffix}")


def _save(agent: str, proposal: "Proposal", best: Path) -> str:
    """Write the parameters to TOML files; return the options of `lgmd-gym bench` that load them."""
    from lgmd_gym.tuning.space import CAMERA_KEY, neuron_params, rule_options

    arguments = f"--agents {agent}:toml={best}"
    _write_toml(best, rule_options(proposal))
    if CAMERA_KEY in proposal:
        arguments += f" --camera {proposal[CAMERA_KEY]}"
    if neuron_params(proposal):
        _write_toml(_neuron_file(best), neuron_params(proposal))
        arguments += f" --params {_neuron_file(best)}"
    return arguments


def _write_toml(path: Path, values: "Proposal") -> None:
    from lgmd_gym.processes.files import complete_file

    with complete_file(path) as part:
        part.write_text("".join(f"{name} = {value!r}\n" for name, value in values.items()), "utf-8")


def _sensitivity_table(space: "SearchSpace", objective: "Objective") -> Table:
    from lgmd_gym.tuning.search import evaluate, sensitivity

    title = f"{space.agent}: each parameter 20 % lower and higher, on validation levels"
    table = Table("parameter", "value", "energy avoided", "false", title=title)
    rows = [("defaults", "", evaluate(space, {}, objective))]
    rows += [(name, f"{value:.4g}", result) for name, value, result in sensitivity(space, objective)]
    for name, value, result in rows:
        false = f"{round(result.false_rate * result.non_threats)}/{result.non_threats}"
        table.add_row(name, value, f"{result.avoided_energy:.3f} (n = {result.threats})", false)
    return table
