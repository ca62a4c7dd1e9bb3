"""The `bench` command; the attribute docstrings of `Bench` are its help texts."""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Literal, cast

from rich.console import Console

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.cli.console import activity, make_console
from lgmd_gym.cli.overview import IDEAS, OVERVIEW, SEEDS, print_overview
from lgmd_gym.cli.values import (
    Count,
    File,
    Name,
    Names,
    chosen_modules,
    default_out,
    note_unused_params,
    read_camera,
    read_params,
    refuse_unused,
)
from lgmd_gym.errors import counted

if TYPE_CHECKING:
    from lgmd_gym.benchmark.case import Row
    from lgmd_gym.benchmark.runner import Run
    from lgmd_gym.processes.pool import Executor

# Options that have an effect on a resumed run.
RESUME_OPTIONS = ("resume", "trust", "jobs", "backend", "address", "plots", "report")


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Run agents on a suite, print the scores and write a run folder.

    The folder contains episodes.jsonl (one row per episode, written as it finishes), episodes.csv,
    summary.csv, report.html with its figures, run.toml, run.json, time series and one PNG per case. Ctrl-C
    keeps the finished episodes.
    """

    suite: Names = None
    """Suites by name (see `lgmd-gym list suites`), each run in a folder of its own; or paths, which are one
    suite: suite or scenario files (.toml, .json), OpenSCENARIO files (.xosc), folders with such files.
    Default: overview."""
    agents: Names = None
    """Agents with options, for example spike-threshold:threshold=45,frames=2; MODULE:CLASS for an agent of
    your own. Default: no-brake always-brake random-brake spike-threshold stopping-zone ttc-oracle; without
    --suite, the paper's rule, the best rule, the best policy if it can be loaded, and the bound."""
    seeds: Count = None
    """Number of seeds per case; a seed sets the start position and the target's grey level. Default: 3;
    of the default suite 2."""
    first_seed: Count = None
    """First seed. Default: 0."""
    module: Names = None
    """Modules with scenario families of your own: my_scenarios, or my_scenarios:MyFamily."""
    conditions: Names = None
    """Weathers, each run separately: clear, night, night_upper_beam, fog, rain, low_sun, or mixed
    for that of each world. Default: clear."""
    worlds: Count = None
    """Number of worlds (asphalt, light, surroundings, brake); 0 for the plain laboratory. Default: 20."""
    first_world: Count = None
    """First world; 8000 to 8999 are the test worlds. Default: 8000."""
    road: Name = None
    """Road under the car: still, smooth, normal or rough. Default: normal, in the laboratory still."""
    camera: Name = None
    """Camera preset: wide, standard, tele, fovea, paper or birdseye; or a TOML file with the fields of a
    camera, or of several as [[camera]] tables. Default: the agent's own, else fovea."""
    params: File = None
    """TOML file of LGMD parameters."""
    neuron: Name = None
    """Neuron model of cameras without their own, with options as in off-only:t_sp=0.78 (see `lgmd-gym neurons
    list`), or MODULE:FACTORY for one of your own. Default: lgmd."""
    config: File = None
    """run.toml of an earlier run to repeat; replaces the options above."""
    resume: File = None
    """Folder of an interrupted run, or of the runs of several suites; runs the missing episodes with the
    settings of that run."""
    trust: bool = False
    """Load modules and policy files that --resume, --config or the suite file names; they can run any
    code."""
    jobs: int = 2
    """Number of processes."""
    backend: Literal["processes", "dask"] = "processes"
    """Executor: local processes or a running Dask cluster."""
    address: Name = None
    """Address of the Dask scheduler, for example tcp://10.0.0.1:8786."""
    out: File = None
    """Run folder; must not exist. With several suites, it contains one for each. Default:
    runs/SUITE-DATE-TIME."""
    plots: bool = True
    """Draw one PNG per case; never for the suite overview."""
    report: bool = True
    """Write report.html."""


def run(options: Bench) -> int:
    """Run suites and print their summaries; return 0 if complete, 1 for failed episodes, 130 for Ctrl-C."""
    from lgmd_gym.benchmark.runner import INTERRUPTED
    from lgmd_gym.processes.pool import Executor

    console = make_console()
    executor = Executor(options.jobs, _cluster(options))
    runs = _new(options, executor) if options.resume is None else _resume(options, executor, console)
    codes: list[int] = []
    for benchmark in runs:
        codes.append(_play(benchmark, options, console))
        if benchmark.stop_reason == INTERRUPTED:
            if len(runs) > 1:
                folder = benchmark.folder.path.parent
                console.print(f"all suites: lgmd-gym bench --resume {folder}", soft_wrap=True)
            break
    return max(codes)


def _play(benchmark: "Run", options: Bench, console: Console) -> int:
    """Play one run and print its summary; return its exit code."""
    from lgmd_gym.benchmark.run_folder import ROWS_FILE
    from lgmd_gym.benchmark.runner import INTERRUPTED, failure_lines
    from lgmd_gym.report.page import write_outputs

    with _progress(benchmark) as count:
        complete = benchmark.play(count)
    path = benchmark.folder.path
    try:
        if benchmark.rows:
            _print_tables(benchmark, console)
        with activity("drawing the figures of the run"):
            plots = options.plots and benchmark.plan.suite.name != OVERVIEW
            files = write_outputs(path, plots, options.report, _trust(options))
        for file in files:
            if file.name == "report.html":
                console.print(f"report: {file}", soft_wrap=True)
    except OSError as error:
        benchmark.stop_reason = benchmark.stop_reason or f"{error.strerror} while writing the outputs"
    failed = sum(row["error"] is not None for row in benchmark.rows)
    if failed:
        console.print(
            f"{counted(failed, 'episode')} failed; the tracebacks are in {path / ROWS_FILE}:", style="red"
        )
        for line in failure_lines(benchmark.rows):
            console.print(f"- {line}")
    if benchmark.stop_reason:
        _print_stop(benchmark, console)
    console.print(f"run folder: {path}", soft_wrap=True)
    if not complete and benchmark.stop_reason == INTERRUPTED:
        return 130
    return int(bool(failed or benchmark.stop_reason))


def _print_stop(benchmark: "Run", console: Console) -> None:
    """Print why a run stopped early, and how to go on."""
    from lgmd_gym.agents.registry import outside_code
    from lgmd_gym.benchmark.runner import failing_agent

    kept = f"{len(benchmark.rows)} of {benchmark.total} episodes kept"
    resume = f"continue with lgmd-gym bench --resume {benchmark.folder.path}"
    own_neuron = ":" in (benchmark.config.neuron or "")
    resume += " --trust" if own_neuron or any(map(outside_code, benchmark.config.agents)) else ""
    if failing_agent(benchmark.rows):
        resume = "correct the agent and start a new run, because --resume repeats no failed episode"
    console.print(f"{benchmark.stop_reason}: {kept}; {resume}", style="yellow", soft_wrap=True)


def _trust(options: Bench) -> bool:
    """Return whether agents may run code from outside the package: those of --agents may."""
    return options.trust or (options.resume is None and options.config is None)


def _cluster(options: Bench) -> str | None:
    """Return the address of the Dask scheduler, or None for local processes."""
    if options.backend == "dask" and options.address is None:
        raise ValueError("--backend dask needs --address tcp://HOST:8786 of the scheduler")
    if options.backend != "dask" and options.address is not None:
        raise ValueError(f"--address {options.address!r} needs --backend dask")
    return options.address


def _resume(options: Bench, executor: "Executor", console: Console) -> "list[Run]":
    """Return the run of a folder, or those of a folder of several suites."""
    from lgmd_gym.benchmark.run_folder import ROWS_FILE
    from lgmd_gym.benchmark.runner import Run

    assert options.resume is not None
    refuse_unused(options, RESUME_OPTIONS)
    several = not (options.resume / ROWS_FILE).exists() and sorted(options.resume.glob(f"*/{ROWS_FILE}"))
    runs: list[Run] = []
    for path in [file.parent for file in several] if several else [options.resume]:
        benchmark = Run.resume(path, executor, options.trust)
        repaired = " after removal of an incomplete last line" if benchmark.folder.repaired else ""
        name = f"{path.name}: " if several else ""
        console.print(f"{name}resuming with {len(benchmark.rows)} of {benchmark.total} episodes{repaired}")
        runs.append(benchmark)
    return runs


def _new(options: Bench, executor: "Executor") -> "list[Run]":
    """Return the new run of the options, or one for each of several suites, in folders of one folder."""
    from lgmd_gym.agents.registry import make_agent
    from lgmd_gym.benchmark.config import RunConfig
    from lgmd_gym.benchmark.runner import Run, check_trust
    from lgmd_gym.engine.first_use import compile_kernels
    from lgmd_gym.processes.files import new_folder

    given: Arguments = {item.name: getattr(options, item.name, None) for item in fields(RunConfig)}
    camera, params = read_camera(options.camera), read_params(options.params)
    given |= {"module": options.module, "camera": camera, "params": params}
    values = {name: value for name, value in given.items() if value is not None}
    if options.config is None:
        if {"suite", "agents"}.isdisjoint(values):
            overview: Arguments = {"agents": tuple(IDEAS), "seeds": SEEDS}
            values = overview | values
        modules = chosen_modules(values.get("suite", ()), values.pop("module", ()), options.trust)
        suites = _suites(values.pop("suite", (OVERVIEW,)))
        configs = [RunConfig(suite=suite, **values, modules=modules) for suite in suites]
    elif values:
        flags = ", ".join(f"--{name.replace('_', '-')}" for name in values)
        raise ValueError(f"--config replaces {flags}; remove the options, or change the file")
    else:
        configs = [RunConfig.load(options.config)]
        check_trust(configs[0], options.config, options.trust)
    agents = list(map(make_agent, configs[0].agents))  # an unknown agent is refused before a compilation
    if executor.cluster is None:
        compile_kernels()  # before the checks, which make environments, and before the progress bar
    root = default_out(options.out, "+".join(config.label for config in configs))
    runs: list[Run] = []
    if len(configs) == 1:
        runs.append(Run.new(configs[0], root, executor))
    else:
        new_folder(root, "run folder")
        try:
            for config in configs:
                runs.append(Run.new(config, root / config.label, executor))
        except BaseException:  # for example an agent that one of the suites refuses
            for run in runs:
                run.folder.discard()
            root.rmdir()
            raise
    if options.params is not None:
        note_unused_params(options.params, agents)
    return runs


def _suites(given: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Return the suites to run one after the other: each name, and all files and folders together."""
    from lgmd_gym.benchmark.suites import is_file

    files = tuple(text for text in given if is_file(text))
    return [(text,) for text in dict.fromkeys(given) if text not in files] + ([files] if files else [])


def _print_tables(benchmark: "Run", console: Console) -> None:
    """Print the tables of every condition."""
    from lgmd_gym.benchmark.analysis import tables
    from lgmd_gym.benchmark.case import is_traffic
    from lgmd_gym.benchmark.summary import by_condition
    from lgmd_gym.benchmark.task import NO_BRAKE
    from lgmd_gym.benchmark.traffic.summary import traffic_table

    config, suite = benchmark.config, benchmark.plan.suite
    if suite.name == OVERVIEW:
        agents = list(dict.fromkeys([NO_BRAKE, *config.agents]))
        print_overview(benchmark.rows, agents, console, config.neuron)
        return
    for condition, rows in by_condition(benchmark.rows).items():
        title = f"{_title(benchmark)}, {condition}"
        if is_traffic(suite.name):
            console.print(traffic_table(rows, list(config.agents), title))
            console.print(traffic_table(rows, list(config.agents), "by kind of traffic", by_kind=True))
            continue
        agents = list(dict.fromkeys([NO_BRAKE, *config.agents]))
        for table in tables.score_tables(rows, agents, title):
            console.print(table)
        console.print(tables.table_by_case(rows, agents, suite))


def _title(benchmark: "Run") -> str:
    """Return the suite, camera, alert level and seeds of a run."""
    from lgmd_gym.neuron import LGMDParams

    config = benchmark.config
    level = LGMDParams.make(config.params).t_sf
    rate = next((f" at {row['fps']:g} Hz" for row in benchmark.rows if row["fps"]), "")  # none in failed rows
    first = f" from {config.first_seed} on" if config.first_seed else ""
    camera = f"camera {config.sensor_config.label}{rate}"
    camera += f", neuron {config.neuron}" if config.neuron else ""
    worlds = f"up to {counted(config.worlds, 'world')}" if config.worlds else "the laboratory"
    seeds = f"{counted(config.seeds, 'seed')}{first} in {worlds}"
    return f"{benchmark.plan.suite.name}: {camera}, T_sf = {level:g} spikes/s, {seeds}"


@contextmanager
def _progress(benchmark: "Run") -> Generator["Callable[[Row], None]", None, None]:
    """Show a progress bar on stderr; yield the function that counts a row."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}", markup=False),
        TimeRemainingColumn(),
        TextColumn("{task.fields[tally]}", markup=False),
    )
    tally = Tally(time.perf_counter())
    for row in benchmark.rows:
        tally.add(row, new=False)
    done, total, suite = len(benchmark.rows), benchmark.total, benchmark.plan.suite.name
    with Progress(*columns, console=Console(stderr=True), speed_estimate_period=60.0) as bar:
        task = bar.add_task(suite, total=total, completed=done, rate="", tally="")

        def count(row: "Row") -> None:
            tally.add(row)
            rate = f"{tally.rate(time.perf_counter()):.1f}/s"
            bar.update(task, advance=1, rate=rate, tally=str(tally))

        yield count


class Tally:
    """Running totals over all agents except `no-brake`.

    Args:
        start: Start of the run [s].
    """

    def __init__(self, start: float) -> None:
        self.start, self.played = start, 0
        self.avoided = self.threats = self.false = self.non_threats = self.failed = 0

    def add(self, row: "Row", new: bool = True) -> None:
        """Count one row; `new` if it was run in this session."""
        self.played += new
        if row["error"] is not None:
            self.failed += 1
        elif row["fcw_driver"] or row["agent"] == "no-brake":
            return
        elif row["threat"]:
            self.threats += 1
            self.avoided += bool(row["avoided"])
        else:
            self.non_threats += 1
            self.false += bool(
                cast(Values, row).get("false_activation", cast(Values, row).get("false_activations"))
            )

    def rate(self, now: float) -> float:
        """Return the episodes per second since the start [1/s]."""
        return self.played / max(now - self.start, 1e-9)

    def __str__(self) -> str:
        parts = [f"avoided {self.avoided}/{self.threats}"] if self.threats else []
        parts += [f"false {self.false}/{self.non_threats}"] if self.non_threats else []
        parts += [f"failed {self.failed}"] if self.failed else []
        return " ".join(parts)
