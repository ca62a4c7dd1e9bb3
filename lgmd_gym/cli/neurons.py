"""The `neurons` command and its subcommands; the attribute docstrings of their options are help texts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, cast

from tyro.conf import Positional, arg

from lgmd_gym.aliases import Values
from lgmd_gym.cli.console import activity, make_console
from lgmd_gym.cli.values import Count, File, Names, Number, default_out, read_camera, read_params
from lgmd_gym.errors import counted

if TYPE_CHECKING:
    from rich.table import Table

    from lgmd_gym.camera import CameraItem
    from lgmd_gym.report.document import DataTable

MAX_ROWS = 45  # of a table in the terminal; longer ones are in the report


@dataclass(frozen=True, kw_only=True)
class ListModels:
    """List the neuron models, the presets of the LGMD, and their options.

    A model with options is written NAME:OPTION=VALUE,OPTION=VALUE, and one of your own MODULE:FACTORY.
    """

    module: Names = None
    """Modules with neuron models of your own: my_neurons, or my_neurons:Mine."""


@dataclass(frozen=True, kw_only=True)
class CompareModels:
    """Compare neuron models on stimuli, clips and simulated approaches, and write one report.

    All models process the same frames. The folder contains report.html, report.md, results.json, a CSV file
    for each table, the figures and run.json.
    """

    models: Annotated[Positional[tuple[str, ...]], arg(metavar="[NEURON ...]")] = ()
    """Models and presets with options, for example off-only:t_sp=0.78; MODULE:FACTORY for a model of your
    own. Default: those of the page "Which neuron?"."""
    module: Names = None
    """Modules that register neuron models of your own."""
    parts: Annotated[tuple[str, ...], arg(metavar="PART [PART ...]")] = (
        "stimuli",
        "clips",
        "simulation",
        "cost",
    )
    """Parts of the report: stimuli, clips (with --clips), simulation, cost."""
    clips: Annotated[tuple[Path, ...] | None, arg(metavar="PATH [PATH ...]")] = None
    """Video files, or folders with video files; requires --crashes."""
    crashes: File = None
    """CSV file with the columns clip,crash_frame (empty for no crash)."""
    clip_fps: Number = None
    """Frame rate to resample clips to [Hz]. Default: the clip's."""
    clip_cap: float = 0.1
    """Highest share of earlier frames of clips in alarm."""
    camera: str = "fovea"
    """Camera of the simulation: a preset, or a TOML file with the fields of one camera."""
    suites: Annotated[tuple[str, ...], arg(metavar="NAME [NAME ...]")] = ("quick",)
    """Suites of the simulation."""
    seeds: Count = None
    """Number of seeds per case. Default: 20, with --quick 3."""
    first_world: int = 6100
    """First of 20 worlds that choose the thresholds; 6000 to 7999 are for validation."""
    test_world: Count = None
    """First of 20 worlds that are played once with these thresholds, for example 8000. Default: none."""
    quick: bool = False
    """Fewer seeds and rounds: a first look in about a minute."""
    jobs: int = 1
    """Number of processes."""
    out: File = None
    """Run folder; must not exist. Default: runs/neurons-DATE-TIME."""


@dataclass(frozen=True, kw_only=True)
class Events:
    """Run the LGMD on recorded events of an event camera, and write its trace to a CSV file.

    The recording is a .npz file with the arrays x, y, t [s] and p (0 and 1, or -1 and 1), and optionally
    shape (height, width). The trace has one row per interval.
    """

    recording: Annotated[Positional[Path], arg(metavar="FILE.npz")]
    """The recording."""
    neuron: str = "events"
    """Model with options, for example events:gain=15,t_sp=0.78."""
    fps: float = 30.0
    """Intervals per second in which events are counted [Hz]."""
    out: File = None
    """CSV file; must not exist. Default: the name of the recording with -trace.csv."""


@dataclass(frozen=True, kw_only=True)
class ExportC:
    """Write the LGMD as C99 source for a robot: lgmd.h, lgmd.c and main.c, a program for stdin.

    Compile with cc -std=c99 -O2 -o lgmd main.c lgmd.c -lm; -DLGMD_FIXED gives 16-bit integer maps.
    """

    out: Annotated[Positional[Path], arg(metavar="FOLDER")]
    """Folder of the files; lgmd.h and lgmd.c are replaced, an existing main.c is kept."""
    shape: Annotated[tuple[int, int], arg(metavar="HEIGHT WIDTH")] = (72, 99)
    """Size of the frames [px]."""
    fps: float = 30.0
    """Frame rate [Hz]."""
    neuron: str = "lgmd"
    """LGMD or one of its presets, with options, for example off-only:t_sp=0.78."""
    params: File = None
    """TOML file of LGMD parameters; the preset and the options change them."""


@dataclass(frozen=True, kw_only=True)
class Neurons:
    """Compare neuron models, list them, run one on events, or export one as C source."""

    SUBCOMMANDS: ClassVar[dict[str, type]] = {
        "compare": CompareModels,
        "events": Events,
        "list": ListModels,
        "export-c": ExportC,
    }

    command: object


def run(options: Neurons) -> int:
    """Run a subcommand and return its exit code."""
    return next(
        RUN[name](options.command)
        for name, cls in Neurons.SUBCOMMANDS.items()
        if isinstance(options.command, cls)
    )


def list_models(options: ListModels) -> int:
    """Print a table of the models."""
    from rich.table import Table

    from lgmd_gym import neuron

    for module in options.module or ():
        neuron.import_models(module)
    table = Table("neuron", "description", title="neuron models")
    for name in neuron.names():
        about, known = neuron.describe(name)
        given = "any" if known is None else ", ".join(known)
        if name in neuron.PRESETS:
            given = "as of lgmd"
        table.add_row(name, f"{about}\noptions: {given}" if given else about)
    make_console().print(table)
    return 0


def compare_models(options: CompareModels) -> int:
    """Write the report of a comparison and print where it is."""
    from lgmd_gym import neuron
    from lgmd_gym.cli.clips import run_folder
    from lgmd_gym.clips.batch import make_jobs
    from lgmd_gym.comparison.models import PAGE_MODELS
    from lgmd_gym.comparison.run import Comparison, compare
    from lgmd_gym.comparison.simulation import Worlds
    from lgmd_gym.report.document import DataTable

    if (options.clips is None) != (options.crashes is None):
        raise ValueError(
            "--clips and --crashes must be used together: videos, and a CSV with clip,crash_frame"
        )
    for module in options.module or ():
        neuron.import_models(module)
    camera = _one_camera(options.camera)
    jobs = [] if options.clips is None else make_jobs(options.clips, options.crashes)
    seeds = options.seeds or (3 if options.quick else 20)
    worlds = Worlds(suites=options.suites, seeds=seeds, first_world=options.first_world, camera=camera)
    settings = Comparison(
        models=options.models or PAGE_MODELS,
        parts=options.parts,
        worlds=worlds,
        test=None if options.test_world is None else replace(worlds, first_world=options.test_world),
        clip_jobs=tuple(job for job in jobs if job.annotated),
        clip_fps=options.clip_fps,
        clip_cap=options.clip_cap,
        quick=options.quick,
        jobs=options.jobs,
    )
    out = default_out(options.out, "neurons")
    values: Values = {**vars(options), "camera": camera, "models": settings.models}
    values["clips"] = [job.clip for job in settings.clip_jobs]
    with run_folder(out, values) as folder:
        document = compare(settings, folder, activity)
    console = make_console()
    for section in document.sections:
        for item in section.shown:
            if isinstance(item, DataTable) and len(item.rows) <= MAX_ROWS:
                console.print(_table(section.title, item))
    console.print(f"report: {out / 'report.html'}", soft_wrap=True)
    return 0


def _one_camera(text: str) -> "CameraItem":
    """Return a preset's name, or the fields of the camera in a file.

    Raises:
        ValueError: If the file cannot be read, or has several cameras, a channel or an unknown field.
    """
    from lgmd_gym.camera import Camera

    given = read_camera(text)
    if isinstance(given, list) and len(given) != 1:
        raise ValueError(
            f"--camera {text!r} has {counted(len(given), 'camera')}, but all models are behind one; "
            "name a file of each, in a comparison of its own"
        )
    camera = cast("CameraItem", given[0] if isinstance(given, list) else given)
    Camera.make(camera)
    return camera


def run_events(options: Events) -> int:
    """Write the trace of a recording and print a summary."""
    import csv

    import numpy as np

    from lgmd_gym import neuron
    from lgmd_gym.neuron import EventLGMD, EventRecording
    from lgmd_gym.processes.files import check_new_file, complete_file

    recording = EventRecording.read(options.recording)
    model = neuron.make(options.neuron, recording.shape, options.fps)
    if not isinstance(model, EventLGMD):
        raise ValueError(f"--neuron must be events with options, got {options.neuron!r}")
    out = options.out or options.recording.with_name(f"{options.recording.stem}-trace.csv")
    check_new_file(out, "--out")
    alerts, peak, number = 0, 0.0, -1
    with complete_file(out) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("interval", "time_s", "on", "off", *neuron.Response._fields))
        model.step_events(np.zeros(recording.shape, np.int32))  # so that the first events are a change
        for number, counts in enumerate(recording.counts(options.fps)):
            outputs = model.step_events(counts)
            on, off = int(counts[counts > 0].sum()), int(-counts[counts < 0].sum())
            values = (f"{float(value):.6g}" for value in outputs.values())
            writer.writerow((number, f"{number / options.fps:.4f}", on, off, *values))
            alerts, peak = alerts + bool(outputs["alert"]), max(peak, outputs["spike_frequency"])
    height, width = recording.shape
    print(f"{len(recording.t)} events of {width}×{height} px in {number + 1} intervals at {options.fps:g} Hz")
    print(f"highest spike frequency {peak:g}/s, {alerts} intervals in alert; trace: {out}")
    return 0


def export_c_source(options: ExportC) -> int:
    """Write the C source of a neuron and print how to compile it."""
    from lgmd_gym import neuron
    from lgmd_gym.neuron.export_c import export_c

    params = neuron.LGMDParams.make(read_params(options.params))
    model = neuron.make(options.neuron, (1, 1), options.fps, params=params)
    if type(model) is not neuron.LGMD:
        raise ValueError(
            f"neuron must be the LGMD or one of its presets, got {options.neuron!r}; others have no C source"
        )
    paths = export_c(options.out, options.shape, options.fps, model.params)
    console = make_console()
    console.print(f"written: {', '.join(map(str, paths))}", soft_wrap=True)
    program = options.out / "lgmd"
    source = f"{options.out / 'main.c'} {options.out / 'lgmd.c'}"
    console.print(f"compile with cc -std=c99 -O2 -o {program} {source} -lm", soft_wrap=True)
    return 0


def _table(title: str, data: "DataTable") -> "Table":
    """Return a table for the terminal."""
    from rich.table import Table

    table = Table(title=f"{title}: {data.name}", caption=data.caption or None, caption_justify="left")
    for index, name in enumerate(data.columns):
        table.add_column(name, justify="right" if index else "left", overflow="fold")
    for row in data.texts():
        table.add_row(*row)
    return table


# The function of each subcommand.
RUN: dict[str, Callable[[Any], int]] = {
    "compare": compare_models,
    "events": run_events,
    "list": list_models,
    "export-c": export_c_source,
}
