"""What each command does with its parsed options."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

if TYPE_CHECKING:
    from lgmd_gym import cli
    from lgmd_gym.benchmark.runner import Run
    from lgmd_gym.benchmark.traffic import TrafficRun


def bench(options: "cli.Bench") -> int:
    """Play a suite and report; 0 if all was played, 1 if an episode failed, 130 after Ctrl-C."""
    from lgmd_gym.benchmark.episode import Eyesight
    from lgmd_gym.benchmark.runs import resume_run, start_run

    console = _console()
    if options.resume is not None:
        run = resume_run(options.resume, options.jobs)
        cut = " after a cut-off last line was taken away" if run.folder.mended else ""
        console.print(f"resuming with {len(run.rows)} of {run.total} episodes{cut}")
    else:
        out = options.out or Path("runs") / f"{options.suite}-{time.strftime('%Y%m%d-%H%M%S')}"
        eyesight = Eyesight(options.camera, _read_params(options.params))
        run = start_run(options.suite, options.agents, options.seeds, options.jobs, out, eyesight)
    with _progress(run) as tick:
        complete = run.play(tick)
    failed = _report(run, console, options.plots)
    if not complete:
        console.print(f"interrupted: {len(run.rows)} of {run.total} episodes kept", style="yellow")
    if failed:
        console.print(f"{failed} episodes failed; their tracebacks are in episodes.jsonl", style="red")
    console.print(f"run folder: {run.folder.path}", soft_wrap=True)
    return 130 if not complete else int(bool(failed))


def drive(options: "cli.Drive") -> int:
    """Play one episode and say how it ended."""
    from lgmd_gym.agents import make_agent
    from lgmd_gym.drive import drive as play

    agent = make_agent(options.agent)
    end = play(
        options.target,
        agent,
        options.seed,
        _parse_arguments(options.set),
        video=options.video,
        live=options.live,
        overlays=options.overlays,
        camera=options.camera,
        params=_read_params(options.params),
    )
    if end.stopped:
        print(f"window closed after {end.duration:.2f} s")
    elif end.collision:
        print(f"contact at {3.6 * end.impact_speed:.1f} km/h relative speed after {end.duration:.2f} s")
    else:
        gap = f"{end.gap:.2f} m ahead free" if end.gap == end.gap else "nothing ahead"
        print(f"no contact: {3.6 * end.ego_speed:.1f} km/h after {end.duration:.2f} s, {gap}")
    if options.video is not None:
        print(f"video: {options.video}")
    return 0


def show_list(options: "cli.List") -> int:
    """Print what there is to name."""
    from lgmd_gym import listing

    listing.show(options.what, _console())
    return 0


def gallery(options: "cli.Gallery") -> int:
    """Make the gallery and say where it is."""
    from lgmd_gym.gallery import make_gallery

    page = make_gallery(options.out, options.families, options.agent, options.seeds, _console().print)
    print(f"gallery: {page}")
    return 0


def doctor(options: "cli.Doctor") -> int:
    """Examine this installation; 1 if something is at fault."""
    from lgmd_gym import doctor as doctors

    console = _console()
    with console.status("the first drive on a machine compiles the kernels, up to a minute"):
        return int(doctors.report(doctors.examine(), console) > 0)


def _report(run: "Run | TrafficRun", console: Console, plots: bool) -> int:
    """Print the tables, write summary and plots, and return the number of failed episodes."""
    from lgmd_gym.benchmark.traffic import TrafficRun
    from lgmd_gym.neuron import LGMDParams

    rows = run.rows
    if rows:
        level = LGMDParams.from_dict(run.eyesight.params or {}).t_sf
        fps = next((f"{row['fps']:g} Hz" for row in rows if row["fps"]), "?")
        eye = f"camera {run.eyesight.camera} at {fps}, T_sf = {level:g} spikes/s"
        title = f"{run.suite}: {eye}, {run.seeds} seeds"
        if isinstance(run, TrafficRun):
            _report_traffic(run, console, f"{title} of {len(run.kinds)} kinds of traffic")
        else:
            _report_cases(run, console, title)
            if plots:
                _draw_cases(run, level)
    return sum(row["error"] is not None for row in rows)


def _report_cases(run: "Run", console: Console, title: str) -> None:
    from lgmd_gym.benchmark import tables
    from lgmd_gym.benchmark.summary import write_summary

    agents = list(dict.fromkeys(["no-brake", *run.agents]))
    console.print(tables.score_table(run.rows, agents, title))
    console.print(tables.verdict_table(run.rows, agents, run.suite) or tables.case_table(run.rows, agents))
    write_summary(run.rows, run.folder.path / "summary.csv")


def _report_traffic(run: "TrafficRun", console: Console, title: str) -> None:
    from lgmd_gym.benchmark.traffic_tables import traffic_table, write_traffic_summary

    console.print(traffic_table(run.rows, run.agents, title))
    console.print(traffic_table(run.rows, run.agents, "by kind of traffic", by_kind=True))
    write_traffic_summary(run.rows, run.folder.path / "summary.csv")


def _draw_cases(run: "Run", alert_level: float) -> None:
    """Draw every case's seed 0, all agents in one figure."""
    import numpy as np

    from lgmd_gym import plots
    from lgmd_gym.benchmark.runner import trace_name

    folder = run.folder.path / "plots"
    folder.mkdir(exist_ok=True)
    for case in run.cases:
        episodes: dict[str, dict[str, Any]] = {}
        for agent in run.agents:
            file = run.folder.path / "traces" / f"{trace_name(case.name, agent)}.npz"
            if file.exists():
                with np.load(file) as series:
                    episodes[agent] = dict(series)
        if episodes:
            name = case.name.replace("/", "_")
            plots.episode_figure(folder / f"{name}.png", f"{case.name}, seed 0", episodes, alert_level)


def _console() -> Console:
    """Return the terminal, or for a file or pipe a page wide enough for the tables."""
    console = Console()
    return console if console.is_terminal else Console(width=110)


@contextmanager
def _progress(run: "Run | TrafficRun") -> Iterator[Any]:
    """Show a progress bar on stderr and yield the function that moves it."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        shown = bar.add_task(run.suite, total=run.total, completed=len(run.rows))
        yield lambda row: bar.advance(shown)


def _read_params(path: Path | None) -> dict[str, Any] | None:
    """Return the LGMD parameters of a TOML file as plain values."""
    if path is None:
        return None
    from lgmd_gym.neuron import LGMDParams

    try:
        return LGMDParams.from_toml(path).to_dict()
    except OSError as error:
        raise ValueError(f"params file {str(path)!r} cannot be read: {error.strerror}") from None


def _parse_arguments(pairs: tuple[str, ...]) -> dict[str, Any]:
    """Return name=value pairs as numbers by name."""
    arguments: dict[str, Any] = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        try:
            arguments[name] = int(value) if name == "shade" else float(value)
        except ValueError:
            raise ValueError(f"--set {pair!r} must be NAME=NUMBER, as in ego_speed=8.3") from None
    return arguments
