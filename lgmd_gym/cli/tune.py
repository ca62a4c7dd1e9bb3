"""What `lgmd-gym tune` does with its parsed options."""

from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from lgmd_gym.cli.options import Tune
    from lgmd_gym.tuning.objective import Ground
    from lgmd_gym.tuning.space import Proposal, Space


def tune(options: "Tune") -> int:
    """Search or, with `--sensitivity`, shift a rule's parameters; print and keep what comes out."""
    from lgmd_gym.tuning import search as tuning
    from lgmd_gym.tuning.objective import Ground
    from lgmd_gym.tuning.space import Space

    space = Space(
        agent=options.agent, cameras=options.cameras, placing=options.placing, neuron=options.neuron
    )
    for name, value, low in (
        ("trials", options.trials, 1),
        ("levels", options.levels, 1),
        ("seeds", options.seeds, 0),
        ("jobs", options.jobs, 1),
    ):
        if value < low:
            raise ValueError(f"{name} must be >= {low}, got {value!r}")
    if not options.false_cost > 0.0:
        raise ValueError(f"false_cost must be > 0, got {options.false_cost!r}")
    console = Console()
    validation = Ground("validation", options.levels, options.seeds, options.jobs)
    if options.sensitivity:
        _sensitivity(space, validation, console)
        return 0
    for path in (options.best, _beside(options.best)):
        if path.exists():
            raise ValueError(f"{str(path)!r} exists and is kept; choose another --best")
    train = Ground("train", options.levels, options.seeds, options.jobs)
    found = tuning.tune(
        space,
        options.study,
        options.trials,
        train,
        validation,
        options.false_cost,
        tell=lambda line: console.print(line, soft_wrap=True),
    )
    console.print(f"chosen on validation levels: {_kept(options.agent, found, options.best)}", soft_wrap=True)
    return 0


def _beside(best: Path) -> Path:
    """Return the file for the neuron's parameters."""
    return best.with_name(f"{best.stem}-neuron{best.suffix}")


def _kept(agent: str, found: "Proposal", best: Path) -> str:
    """Write what was found into files, and return the options of `lgmd-gym bench` that use them."""
    from lgmd_gym.tuning.space import CAMERA, neuron_params, rule_options

    told = f"--agents {agent}:toml={best}"
    _write(best, rule_options(found))
    if CAMERA in found:
        told += f" --camera {found[CAMERA]}"
    if neuron_params(found):
        _write(_beside(best), neuron_params(found))
        told += f" --params {_beside(best)}"
    return told


def _write(path: Path, values: "Proposal") -> None:
    path.write_text("".join(f"{name} = {value!r}\n" for name, value in values.items()), "utf-8")


def _sensitivity(space: "Space", ground: "Ground", console: Console) -> None:
    from lgmd_gym.tuning import search as tuning

    base = tuning.scored(space, {}, ground)
    title = f"{space.agent}: each parameter 20 % lower and higher, on validation levels"
    table = Table("parameter", "value", "energy avoided", "false", title=title)
    rows = [("defaults", "", base)]
    rows += [(name, f"{value:.4g}", score) for name, value, score in tuning.sensitivity(space, ground)]
    for name, value, score in rows:
        false = f"{round(score.false_rate * score.quiet)}/{score.quiet}"
        table.add_row(name, value, f"{score.avoided_energy:.3f} (n = {score.threats})", false)
    console.print(table)
