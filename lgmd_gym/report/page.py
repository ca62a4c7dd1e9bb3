"""Output files of a run folder: tables, plots, and the report page, rendered with `page.html`."""

from pathlib import Path

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.analysis.froc import LEAD_TIME, froc_curves, load_traces, write_froc
from lgmd_gym.benchmark.analysis.tables import (
    agent_summaries,
    limit_lines,
    mean_kmh,
    rate_text,
    success_lines,
    verdict_text,
)
from lgmd_gym.benchmark.case import Row, is_traffic
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.run_folder import case_name, read_run, read_series, rows_file, series_name
from lgmd_gym.benchmark.suites import get_suite
from lgmd_gym.benchmark.summary import (
    FILE,
    INTERVAL_TEXT,
    Sample,
    by_condition,
    without_fcw_driver,
    write_episodes,
    write_summary,
)
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.benchmark.traffic.summary import write_traffic_summary
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.plotting.figures import episode_figure
from lgmd_gym.processes.files import FolderLock, replace_file
from lgmd_gym.report.conclusion import agent_note, conclusion
from lgmd_gym.report.figures import (
    CELL_COLOURS,
    DARK_CELLS,
    MAX_PANELS,
    ReportFigure,
    avoidance_figure,
    case_grids,
    grid_figure,
    impact_figure,
)
from lgmd_gym.report.sections import (
    ReportData,
    comparison_section,
    episode_section,
    false_activation_section,
    froc_section,
    illustrated_agent,
    own_signal,
)
from lgmd_gym.report.svg import DARK_CSS, legend_mark, to_text
from lgmd_gym.report.sweep import band, scenario_pictures, sweep_grids, swept_arguments
from lgmd_gym.report.traffic import write_traffic_report
from lgmd_gym.statistics.intervals import Rate


def write_report(path: Path, trust: bool = False) -> Path:
    """Write `report.html` and its `figures/` into a run folder and return the path of the page.

    The page contains all of its figures. Each is also a file with its data, `figures/<name>.svg` and `.csv`;
    files of an earlier report are replaced. Only the episodes whose camera frames are shown are simulated
    again.

    Args:
        path: Run folder.
        trust: Whether to load agents from modules and policy files that the folder names. Otherwise the
            report shows no camera frames of these agents.

    Raises:
        ValueError: If the folder contains no run or a damaged one.
    """
    data = ReportData.load(path, trust)
    file = path / "report.html"
    replace_file(file, _render(data))
    return file


def _render(data: ReportData) -> str:
    """Return the page; the figures are written to files meanwhile."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("lgmd_gym.report", "."), autoescape=True, undefined=StrictUndefined
    )
    environment.filters |= {"band": band, "rate_band": rate_band, "rate": rate_text, "kmh": mean_kmh}
    environment.filters["svg"] = to_text
    families = {case.name: case.family for case in data.suite.cases}
    return environment.get_template("page.html").render(
        data=data,
        interval=INTERVAL_TEXT,
        conclusion=conclusion(data.rows, data.agents, data.suite),
        notes=[(agent, agent_note(agent, agent not in data.agents_not_loaded)) for agent in data.agents],
        legend=[(agent, legend_mark(series)) for series, agent in enumerate(data.agents)],
        families=families,
        max_panels=MAX_PANELS,
        cell_colours=CELL_COLOURS,
        dark_cells=DARK_CELLS,
        dark_css=DARK_CSS,
        failed=sum(row["error"] is not None for row in data.rows),
        pictures=scenario_pictures(data),
        swept=swept_arguments(data.suite),
        conditions=[_condition(data, name, rows) for name, rows in by_condition(data.rows).items()],
        froc=froc_section(data),
        lead_time=LEAD_TIME,
        comparisons=comparison_section(data),
        illustrated=illustrated_agent(data.agents),
        episodes=episode_section(data),
        false_activations=false_activation_section(data),
    )


def rate_band(rate: Rate, lower_is_better: bool = False) -> str:
    """Return the colour of a rate; "" for an empty one."""
    if rate.n == 0:
        return ""
    share = rate.k / rate.n
    return band(1.0 - share if lower_is_better else share)


def _condition(data: ReportData, name: str, rows: list[Row]) -> Values:
    """Return the tables and figures of one camera condition."""
    braking = [agent for agent in data.agents if agent != NO_BRAKE]
    points = data.suite.points
    swept = [grid for agent in braking for grid in sweep_grids(rows, agent, data.suite.by_name)]
    grids = [grid for agent in braking for grid in case_grids(rows, agent, data.suite)]
    return {
        "name": name,
        "sample": Sample.of(rows),
        "summaries": agent_summaries(without_fcw_driver(rows), data.agents),
        "limits": limit_lines(rows, data.agents, data.suite),
        "verdict": verdict_text(rows, data.agents, data.suite),
        "points": [(agent, points(rows, agent)) for agent in braking] if points else [],
        "avoidance": _saved(data, avoidance_figure(rows, data.agents, name)),
        "impacts": _saved(data, impact_figure(rows, data.agents, name)),
        "grids": _saved(data, grid_figure(grids, name)),
        "sweep": _saved(data, grid_figure(swept, name, "sweep", "Sweep")),
        "cases": success_lines(rows, data.agents),
    }


def _saved(data: ReportData, figure: ReportFigure | None) -> ReportFigure | None:
    """Write the files of a figure and return it."""
    if figure is not None:
        figure.write(data.figures)
    return figure


def write_outputs(path: Path, plots: bool = True, report: bool = True, trust: bool = False) -> list[Path]:
    """Write episodes.csv and summary.csv into a run folder, and its report.html with figures/.

    A suite of cases also gets plots/ and froc.csv. Files of an earlier call are replaced.

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
    if is_traffic(config.suite):
        write_traffic_summary(rows, files[1])
        return [*files, write_traffic_report(path)] if report else files
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
    folder, seed, files = path / "plots", config.first_seed, list[Path]()
    folder.mkdir(exist_ok=True)
    for condition in config.conditions:
        for case in get_suite(config.suite).cases:
            names = {agent: series_name((agent, case.name, seed, condition)) for agent in config.agents}
            loaded = {agent: read_series(path, name) for agent, name in names.items()}
            episodes = {agent: series for agent, series in loaded.items() if series is not None}
            if episodes:
                files.append(folder / f"{case_name(case.name, condition)}.png")
                title = f"{case.name}, seed {seed}, {condition}"
                episode_figure(files[-1], title, episodes, alert_level, own_signal(config))
    return files
