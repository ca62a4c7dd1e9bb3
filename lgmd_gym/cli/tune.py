"""The `tune` command; the attribute docstrings of `Tune` are its help texts."""

import sys
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.table import Table
from tyro.conf import arg

from lgmd_gym.cli.console import activity, make_console
from lgmd_gym.cli.values import File, Number, read_params

if TYPE_CHECKING:
    from lgmd_gym.clips.batch import ClipJob
    from lgmd_gym.clips.detection import ClipDetection
    from lgmd_gym.neuron import LGMDParams
    from lgmd_gym.tuning.clips import ClipsFit
    from lgmd_gym.tuning.objective import Objective
    from lgmd_gym.tuning.space import Proposal, SearchSpace

RULE_OPTIONS = ("agent", "cameras", "camera_geometry", "levels", "seeds", "study", "sensitivity")
CLIP_OPTIONS = ("crashes", "params", "fps", "size", "drop_duplicates", "lead")


@dataclass(frozen=True, kw_only=True)
class Tune:
    """Search the parameters of a rule on levels and false-reaction cases, or of the neuron on clips.

    A rule is tuned on training levels of LGMD/RandomBraking-v0 and false-reaction cases. Validation levels
    choose between the defaults and the best trials; test levels and protocol suites are not used. A trial
    takes seconds with fixed sensors, because the sensor outputs are recorded once, and about a minute with
    --cameras, --camera-geometry or --neuron.

    With --clips, the parameters of --neuron are fitted to annotated video clips, and the table shows the
    outcome in each clip with the parameters that are best on all other clips.
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
    clips: tuple[str, ...] = ()
    """Annotated video files, or folders with them; fits the parameters of --neuron to them."""
    crashes: File = None
    """With --clips: CSV file with the columns clip,crash_frame (empty for no crash)."""
    params: File = None
    """With --clips: TOML file of the other LGMD parameters, which is also the first trial."""
    fps: Number = None
    """With --clips: frame rate to resample to [Hz]. Default: the clip's."""
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None
    """With --clips: size to scale to [px]. Default: the clip's."""
    drop_duplicates: float = 0.0
    """With --clips: threshold of the duplicate filter, for example 0.25; 0 disables it."""
    lead: float = 0.3
    """With --clips: shortest time from the alarm to the crash that counts as a hit [s]."""
    trials: int = 40
    """Number of trials to add to the study; with --clips, number of trials."""
    levels: int = 100
    """Number of levels of each split; half of them are threats."""
    seeds: int = 1
    """Number of seeds of the false-reaction suite, from 1000 for trials and from 2000 for validation."""
    false_cost: float = 1.0
    """Cost of a false activation, relative to a contact at full speed; with --clips, cost of an alarm in all
    earlier frames, relative to a missed crash."""
    jobs: int = 2
    """Number of processes."""
    study: Path = Path("tune.db")
    """SQLite file of the study; an existing study is resumed."""
    best: Path = Path("best.toml")
    """TOML file for the best parameters; must not exist. BEST-neuron.toml gets the neuron parameters of a
    rule."""
    sensitivity: bool = False
    """Print the sensitivity table (each parameter shifted by 20 % down and up) instead of searching."""


def run(options: Tune) -> int:
    """Search the parameters and write them, or print the sensitivity table; return 0, or 130 for Ctrl-C."""
    from lgmd_gym.processes.files import check_new_file
    from lgmd_gym.tuning.objective import Objective
    from lgmd_gym.tuning.search import tune
    from lgmd_gym.tuning.space import SearchSpace

    _refuse_unused(options)
    if options.clips:
        _check(options)
        return _fit_clips(options)
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


def _refuse_unused(options: Tune) -> None:
    unused, subject = (
        (RULE_OPTIONS, "--clips fits the neuron to clips")
        if options.clips
        else (CLIP_OPTIONS, "without --clips")
    )
    defaults = {item.name: item.default for item in fields(Tune)}
    given = [f"--{name.replace('_', '-')}" for name in unused if getattr(options, name) != defaults[name]]
    if given:
        raise ValueError(f"{subject}, {', '.join(given)} would have no effect; remove them")


def _fit_clips(options: Tune) -> int:
    """Fit neuron parameters to clips, print the outcome in each clip and write the parameters."""
    from lgmd_gym.clips.batch import make_jobs
    from lgmd_gym.clips.playback import PlaybackConfig
    from lgmd_gym.neuron import LGMDParams
    from lgmd_gym.processes.files import check_new_file, complete_file
    from lgmd_gym.tuning.clips import fit_clips

    if options.crashes is None:
        raise ValueError("--clips needs --crashes FILE, a CSV file with the columns clip,crash_frame")
    check_new_file(options.best, "--best")
    jobs = [job for job in make_jobs(options.clips, options.crashes) if job.annotated]
    config = PlaybackConfig(
        params=LGMDParams.make(read_params(options.params)), fps=options.fps, size=options.size,
        drop_duplicates=options.drop_duplicates,
    )  # fmt: skip
    with activity(f"evaluating {options.trials} trials on {len(jobs)} clips"):
        fit = fit_clips(
            jobs,
            options.neuron,
            options.trials,
            config,
            options.false_cost,
            options.lead,
            processes=options.jobs,
        )
    console = make_console()
    console.print(_clip_table(options, jobs, fit))
    console.print(f"best on all clips: {_changed(fit.best, options.neuron)}", soft_wrap=True)
    with complete_file(options.best) as part:
        fit.best.to_toml(part)
    console.print(f"options of lgmd-gym video for them: --params {options.best}", soft_wrap=True)
    return 0


def _clip_table(options: Tune, jobs: "list[ClipJob]", fit: "ClipsFit") -> Table:
    """Return the outcome in each clip with the default parameters and those fitted to the other clips."""
    from lgmd_gym.tuning.clips import ClipsValue

    title = "before: parameters at the start; left out: fitted to the other clips; fitted: to all clips"
    table = Table("clip", "before", "left out", "fitted", "parameters without the clip", title=title)
    rows = zip(jobs, fit.default, fit.left_out, fit.fitted, fit.chosen, strict=True)
    for job, *found, chosen in rows:
        table.add_row(job.clip.stem, *map(_outcome, found), _changed(chosen, options.neuron))
    totals = [ClipsValue.of(items, options.lead) for items in (fit.default, fit.left_out, fit.fitted)]
    table.add_section()
    table.add_row(f"onset {options.lead:g} s before", *(f"{item.hits} of {item.crashes}" for item in totals))
    shares = [100.0 * item.alarm_frames / max(item.frames, 1) for item in totals]
    table.add_row("earlier frames in alarm", *(f"{share:.1f} %" for share in shares))
    table.add_row("value", *(f"{item.total(options.false_cost):.3f}" for item in totals))
    return table


def _outcome(found: "ClipDetection") -> str:
    lead = "" if found.crash_s is None else "missed, " if found.lead_s is None else f"{found.lead_s:.2f} s, "
    return f"{lead}{100.0 * found.alarm_frames.k / max(found.alarm_frames.n, 1):.0f} %"


def _changed(params: "LGMDParams", names: tuple[str, ...]) -> str:
    return ", ".join(f"{name} {getattr(params, name):.3g}" for name in names)


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
