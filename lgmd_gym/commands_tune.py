"""What `lgmd-gym tune` does with its parsed options."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from lgmd_gym.cli_options import Tune
    from lgmd_gym.tuning_ground import Ground


def tune(options: "Tune") -> int:
    """Search or, with `--sensitivity`, shift a rule's parameters; print and keep what comes out."""
    from lgmd_gym import tuning
    from lgmd_gym.tuning_ground import Ground

    tuning.tunable(options.agent)
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
        _sensitivity(options.agent, validation, console)
        return 0
    if options.best.exists():
        raise ValueError(f"{str(options.best)!r} exists and is kept; choose another --best")
    train = Ground("train", options.levels, options.seeds, options.jobs)
    found = tuning.tune(
        options.agent,
        options.study,
        options.trials,
        train,
        validation,
        options.false_cost,
        tell=lambda line: console.print(line, soft_wrap=True),
    )
    options.best.write_text("".join(f"{name} = {value!r}\n" for name, value in found.items()), "utf-8")
    console.print(f"chosen on validation levels: --agents {options.agent}:toml={options.best}")
    return 0


def _sensitivity(agent: str, ground: "Ground", console: Console) -> None:
    from lgmd_gym import tuning

    base = ground.score(agent)
    title = f"{agent}: each parameter 20 % lower and higher, on validation levels"
    table = Table("parameter", "value", "energy avoided", "false", title=title)
    rows = [("defaults", "", base)]
    rows += [(name, f"{value:.4g}", score) for name, value, score in tuning.sensitivity(agent, ground)]
    for name, value, score in rows:
        false = f"{round(score.false_rate * score.quiet)}/{score.quiet}"
        table.add_row(name, value, f"{score.avoided_energy:.3f} (n = {score.threats})", false)
    console.print(table)
