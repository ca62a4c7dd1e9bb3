"""Output files that are written to a run folder after its episodes."""

from pathlib import Path

from lgmd_gym.benchmark.analysis.froc import LEAD_TIME, froc_curves, load_traces, write_froc
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.episode_table import FILE, write_episodes
from lgmd_gym.benchmark.file_names import case_name, series_name
from lgmd_gym.benchmark.stored_run import read_run, read_series, rows_file
from lgmd_gym.benchmark.suite_file import get_suite
from lgmd_gym.benchmark.suites import TRAFFIC
from lgmd_gym.benchmark.summary import write_summary
from lgmd_gym.benchmark.traffic.summary import write_traffic_summary
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.plotting.figures import episode_figure
from lgmd_gym.processes.files import FolderLock
from lgmd_gym.report.page import write_report


def write_outputs(path: Path, plots: bool = True, report: bool = True, trust: bool = False) -> list[Path]:
    """Write episodes.csv and summary.csv into a run folder, and for a suite of cases its plots and report.

    A suite of cases also gets plots/, froc.csv, figures/ and report.html. Files of an earlier call are
    replaced.

    The folder is locked meanwhile: an older state of the run does not replace the outputs of a newer one.

    Args:
        path: Run folder; a run without rows gets no files.
        plots: Whether to draw one PNG per case.
        report: Whether to write report.html and its figures/.
        trust: See `write_report`.

    Returns:
        The files written.

    Raises:
        ValueError: If the folder contains no run or a damaged one, or another process writes to it.
    """
    rows_file(path)
    lock = FolderLock(path)
    try:
        return _write(path, plots, report, trust)
    finally:
        lock.release()


def _write(path: Path, plots: bool, report: bool, trust: bool) -> list[Path]:
    config, rows, _ = read_run(path)
    if not rows:
        return []
    files = [path / FILE, path / "summary.csv"]
    write_episodes(rows, files[0])
    if config.suite == TRAFFIC:
        write_traffic_summary(rows, files[1])
        return files
    write_summary(rows, files[1])
    if plots:
        files += _plot_cases(path, config)
    traces = load_traces(path)
    if traces:
        files.append(path / "froc.csv")
        write_froc(files[-1], froc_curves(traces), LEAD_TIME)
    if report:
        files.append(write_report(path, trust))
    return files


def _plot_cases(path: Path, config: RunConfig) -> list[Path]:
    """Draw one figure per case: all agents with the first seed."""
    alert_level = LGMDParams.make(config.params).t_sf
    folder, seed, files = path / "plots", config.first_seed, []
    folder.mkdir(exist_ok=True)
    for condition in config.conditions:
        for case in get_suite(config.suite).cases:
            names = {agent: series_name((agent, case.name, seed, condition)) for agent in config.agents}
            loaded = {agent: read_series(path, name) for agent, name in names.items()}
            episodes = {agent: series for agent, series in loaded.items() if series is not None}
            if episodes:
                files.append(folder / f"{case_name(case.name, condition)}.png")
                title = f"{case.name}, seed {seed}, {condition}"
                episode_figure(files[-1], title, episodes, alert_level)
    return files
