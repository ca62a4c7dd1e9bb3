"""What `lgmd-gym bench` and `lgmd-gym compare` do with their parsed options."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.params import read_params

if TYPE_CHECKING:
    from lgmd_gym.benchmark.run_cases import Run
    from lgmd_gym.benchmark.traffic.run import TrafficRun
    from lgmd_gym.cli.options import Bench, Compare, Judge

SUITE, SEEDS = "quick", 3


def bench(options: "Bench") -> int:
    """Play a suite and report; 0 if all was played, 1 if something failed, 130 after Ctrl-C."""
    console = make_console()
    run = _resumed(options, console) if options.resume is not None else _new(options, console)
    with _progress(run) as tick:
        complete = run.play(tick)
    failed = sum(row["error"] is not None for row in run.rows)
    try:
        _report(run, console, options)
    except OSError as error:
        run.stopped = run.stopped or f"{error.strerror} while the report was written"
    if failed:
        console.print(f"{failed} episodes failed; their tracebacks are in episodes.jsonl", style="red")
    if run.stopped:
        kept = f"{len(run.rows)} of {run.total} episodes kept"
        go_on = f"lgmd-gym bench --resume {run.folder.path}"
        console.print(f"{run.stopped}: {kept}; go on with {go_on}", style="yellow", soft_wrap=True)
    console.print(f"run folder: {run.folder.path}", soft_wrap=True)
    if not complete and run.stopped == "interrupted":
        return 130
    return int(bool(failed or run.stopped))


def compare(options: "Compare") -> int:
    """Print and draw the paired differences of two runs, or of agents within one."""
    from lgmd_gym.benchmark.analysis import plots as plots_bench
    from lgmd_gym.benchmark.analysis.compare import compare_runs
    from lgmd_gym.benchmark.analysis.compare_tables import compare_table

    if options.out is not None and options.out.exists():
        raise ValueError(f"{str(options.out)!r} exists and is kept; choose another --out")
    found = compare_runs(options.run_a, options.run_b, options.agents)
    console = make_console()
    for item in found:
        console.print(compare_table(item))
    if options.out is not None:
        plots_bench.difference_figure(options.out, found)
        console.print(f"figure: {options.out}", soft_wrap=True)
    return 0


def judge(options: "Judge") -> int:
    """Print the arms of a run."""
    from lgmd_gym.benchmark.analysis.trainings import judge_run
    from lgmd_gym.benchmark.analysis.trainings_tables import judge_table

    arms = judge_run(options.run, options.arms)
    for condition in dict.fromkeys(arm.condition for arm in arms):
        told = [arm for arm in arms if arm.condition == condition]
        make_console().print(judge_table(told, f"{options.run.name}, {condition}"))
    return 0


def _cluster(options: "Bench") -> str | None:
    """Return the cluster's address that the options name, None for processes."""
    if options.backend == "dask" and options.address is None:
        raise ValueError("--backend dask needs --address tcp://HOST:8786, the scheduler's")
    if options.backend != "dask" and options.address is not None:
        raise ValueError(f"--address {options.address!r} needs --backend dask")
    return options.address


def _resumed(options: "Bench", console: Console) -> "Run | TrafficRun":
    from lgmd_gym.benchmark.runs import resume_run

    assert options.resume is not None
    run = resume_run(options.resume, options.jobs, _cluster(options))
    cut = " after a cut-off last line was taken away" if run.folder.mended else ""
    console.print(f"resuming with {len(run.rows)} of {run.total} episodes{cut}")
    return run


def _new(options: "Bench", console: Console) -> "Run | TrafficRun":
    from lgmd_gym.benchmark.config import RunConfig
    from lgmd_gym.benchmark.run_cases import DEFAULT_AGENTS
    from lgmd_gym.benchmark.runs import repeat_run

    cluster = _cluster(options)
    given = {
        "suite": options.suite,
        "agents": options.agents,
        "seeds": options.seeds,
        "first_seed": options.first_seed,
        "conditions": options.conditions,
        "camera": options.camera,
        "params": read_params(options.params),
    }
    given = {name: value for name, value in given.items() if value is not None}
    if options.config is None:
        config = RunConfig(**({"suite": SUITE, "agents": DEFAULT_AGENTS, "seeds": SEEDS} | given))
    else:
        if given:
            names = ", ".join(f"--{name.replace('_', '-')}" for name in given)
            raise ValueError(f"--config says what to play; leave out {names}, or change the file")
        config = RunConfig.load(options.config)
    name = Path(config.suite).stem
    out = options.out or Path("runs") / f"{name}-{time.strftime('%Y%m%d-%H%M%S')}"
    return repeat_run(config, options.jobs, out, cluster)


def _report(run: "Run | TrafficRun", console: Console, options: "Bench") -> None:
    """Print the tables; write summary, plots and report."""
    from lgmd_gym.benchmark.traffic.run import TrafficRun
    from lgmd_gym.neuron import LGMDParams

    rows = run.rows
    if not rows:
        return
    level = LGMDParams.from_dict(run.sensor_config.params or {}).t_sf
    fps = next((f"{row['fps']:g} Hz" for row in rows if row["fps"]), "?")
    eye = f"camera {run.sensor_config.label} at {fps}, T_sf = {level:g} spikes/s"
    first = f" from {run.config.first_seed} on" if run.config.first_seed else ""
    title = f"{run.suite}: {eye}, {run.seeds} seeds{first}"
    if isinstance(run, TrafficRun):
        _report_traffic(run, console, f"{title} of {len(run.kinds)} kinds of traffic")
        return
    _report_cases(run, console, title)
    if options.plots:
        _draw_cases(run, level)
    _write_curves(run.folder.path)
    if options.report:
        from lgmd_gym.report import write_report

        console.print(f"report: {write_report(run.folder.path)}", soft_wrap=True)


def _report_cases(run: "Run", console: Console, title: str) -> None:
    from lgmd_gym.benchmark.analysis import tables
    from lgmd_gym.benchmark.summary import by_condition, write_summary

    agents = list(dict.fromkeys(["no-brake", *run.agents]))
    for condition, rows in by_condition(run.rows).items():
        for table in tables.score_tables(rows, agents, f"{title}, {condition}"):
            console.print(table)
        console.print(tables.verdict_table(rows, agents, run.suite) or tables.case_table(rows, agents))
    write_summary(run.rows, run.folder.path / "summary.csv")


def _report_traffic(run: "TrafficRun", console: Console, title: str) -> None:
    from lgmd_gym.benchmark.traffic.tables import traffic_table, write_traffic_summary

    console.print(traffic_table(run.rows, run.agents, title))
    console.print(traffic_table(run.rows, run.agents, "by kind of traffic", by_kind=True))
    write_traffic_summary(run.rows, run.folder.path / "summary.csv")


def _write_curves(path: Path) -> None:
    """Write the detector curves of a run folder as froc.csv, if any trace has been kept."""
    from lgmd_gym.benchmark.analysis.froc import LEAD, curves, load_traces, write_curves

    traces = load_traces(path)
    if traces:
        write_curves(path / "froc.csv", curves(traces), LEAD)


def _draw_cases(run: "Run", alert_level: float) -> None:
    """Draw every case's first seed, all agents in one figure."""
    from lgmd_gym.benchmark.run_cases import trace_name
    from lgmd_gym.plotting import figures as plots

    seed = run.config.first_seed
    folder = run.folder.path / "plots"
    folder.mkdir(exist_ok=True)
    for condition in run.conditions:
        for case in run.cases:
            names = {agent: trace_name(agent, case.name, seed, condition) for agent in run.agents}
            found = {agent: run.folder.series(name) for agent, name in names.items()}
            episodes = {agent: series for agent, series in found.items() if series is not None}
            if episodes:
                file = trace_name("", case.name, seed, condition).replace(f"____seed{seed}", "")
                title = f"{case.name}, seed {seed}, {condition}"
                plots.episode_figure(folder / f"{file}.png", title, episodes, alert_level)


@contextmanager
def _progress(run: "Run | TrafficRun") -> Iterator[Any]:
    """Show done, rate, time left and running score on stderr; yield the function that moves it."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[score]}"),
    )
    tally = Tally(time.perf_counter())
    for row in run.rows:
        tally.count(row, fresh=False)
    with Progress(*columns, console=Console(stderr=True), speed_estimate_period=60.0) as bar:
        shown = bar.add_task(run.suite, total=run.total, completed=len(run.rows), rate="", score="")

        def tick(row: dict[str, Any]) -> None:
            tally.count(row)
            rate = f"{tally.rate(time.perf_counter()):.1f}/s"
            bar.update(shown, advance=1, rate=rate, score=tally.score)

        yield tick


class Tally:
    """The running score of a run, over all agents that can brake.

    Args:
        start: When it began [s].
    """

    def __init__(self, start: float) -> None:
        self.start, self.played = start, 0
        self.avoided = self.threats = self.false = self.quiet = self.failed = 0

    def count(self, row: dict[str, Any], fresh: bool = True) -> None:
        """Count one row; `fresh` if it was played just now."""
        self.played += fresh
        if row["error"] is not None:
            self.failed += 1
        elif row.get("fcw_driver"):
            return  # no automatic braking
        elif row["agent"] != "no-brake" and row["threat"]:
            self.threats += 1
            self.avoided += bool(row["avoided"])
        elif row["agent"] != "no-brake":
            self.quiet += 1
            self.false += bool(row.get("false_activation", row.get("false_activations")))

    def rate(self, now: float) -> float:
        """Return the episodes per second since the start [1/s]."""
        return self.played / max(now - self.start, 1e-9)

    @property
    def score(self) -> str:
        """What stands so far."""
        parts = [f"avoided {self.avoided}/{self.threats}"] if self.threats else []
        parts += [f"false {self.false}/{self.quiet}"] if self.quiet else []
        parts += [f"failed {self.failed}"] if self.failed else []
        return " ".join(parts)
