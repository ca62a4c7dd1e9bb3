"""Report page of a run of traffic: activations, speed lost and contacts of each agent."""

from collections.abc import Sequence
from math import nan
from pathlib import Path

from lgmd_gym.benchmark.case import EpisodeRow
from lgmd_gym.benchmark.config import RunConfig
from lgmd_gym.benchmark.run_folder import read_run, read_settings
from lgmd_gym.benchmark.summary import Sample, by_condition, write_csv
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.benchmark.traffic.summary import TrafficSummary, traffic_summaries
from lgmd_gym.envs.traffic.emergencies import EMERGENCY_SHARE, HORIZON
from lgmd_gym.errors import counted
from lgmd_gym.plotting.style import COLOURS, saved_figure
from lgmd_gym.processes.files import replace_file
from lgmd_gym.report.document import DataTable, Document, Figure, Section

COLUMNS = (
    "agent",
    "km",
    "needless activations per 100 km",
    "speed lost [m/s] per 100 km",
    "brakes",
    "avoided by a needed brake",
    "vanished",
    "not avoidable",
    "contacts",
    "caused",
    "rear-ended",
    "of the standing ego",
)
STYLES = ("", ".1f", "", ".1f", *("d",) * 8)
CAPTION = (
    "Needless: without the brake, no contact and no required deceleration of "
    f"{100.0 * EMERGENCY_SHARE:.0f} % of full braking within {HORIZON:g} s; [95 % interval, clustered by "
    "drive and world]. Speed lost: in needless brakes, against the same drive without them. Avoided by a "
    "needed brake: of the contacts without agent that full braking avoids, except those that vanished "
    "because of earlier braking. Not avoidable: contacts without agent that it does not avoid. Caused: "
    "contacts that would not follow without the brake. Of the standing ego: another car drove into it."
)
BENEFIT = "avoided-against-speed-lost"


def write_traffic_report(path: Path) -> Path:
    """Write `report.html` and its figure into the folder of a run of traffic; return the path of the page.

    Raises:
        ValueError: If the folder contains no run or a damaged one.
    """
    run = read_run(path)
    document = Document(
        str(run.config.suite),
        _introduction(path, run.config, run.rows),
        tuple(
            _section(path, run.config, condition, part) for condition, part in by_condition(run.rows).items()
        ),
    )
    file = path / "report.html"
    replace_file(file, document.html(file.parent))
    return file


def _introduction(path: Path, config: RunConfig, rows: Sequence[EpisodeRow]) -> str:
    """Return the paragraphs before the tables."""
    failed = sum(row["error"] is not None for row in rows)
    sentences = [
        f"{counted(len(rows), 'episode')} in {Sample.of(rows)}; camera {config.sensor_config.label}. "
        "An IDM driver controls the car in highway-env's traffic, and the agents can only add braking.",
        "The run is incomplete." if not read_settings(path).get("complete") else "",
        f"{counted(failed, 'episode')} failed; episodes.jsonl holds the tracebacks." if failed else "",
        "All results are from simulation; drivers err more often than on real roads where they err at all. "
        "All episodes: episodes.csv; all columns by kind of traffic: summary.csv.",
    ]
    return "\n\n".join(filter(None, sentences))


def _section(path: Path, config: RunConfig, condition: str, rows: Sequence[EpisodeRow]) -> Section:
    """Return the tables and the figure of one condition."""
    summaries = _ordered(traffic_summaries(rows), config)
    kinds = _ordered(traffic_summaries(rows, by_kind=True), config)
    tables = (
        DataTable("agents", COLUMNS, [_cells(item) for item in summaries], STYLES, CAPTION),
        DataTable(
            "kinds",
            ("agent", "kind", *COLUMNS[1:]),
            [[item.agent, item.kind, *_cells(item)[1:]] for item in kinds],
            ("", *STYLES),
        ),
    )
    name = f"{BENEFIT}-{condition}"
    braking = [item for item in summaries if item.agent != NO_BRAKE and item.distance > 0.0]
    if not braking or not any(item.avoided_by_brake.n for item in braking):
        return Section(condition, "", tables)
    _draw(path / "figures" / name, braking)
    caption = (
        "Best is the upper left corner. Lines: 95 % interval of the share. The scale of the speed lost is "
        f"linear up to 10 m/s. Data: figures/{name}.csv."
    )
    return Section(condition, "", (tables[0], Figure(f"figures/{name}.svg", caption), tables[1]))


def _ordered(summaries: list[TrafficSummary], config: RunConfig) -> list[TrafficSummary]:
    order = {agent: index for index, agent in enumerate(config.agents)}
    return sorted(summaries, key=lambda item: order[item.agent])


def _cells(item: TrafficSummary) -> list[object]:
    """Return the values of `COLUMNS`."""
    rate = item.avoided_by_brake
    interval, lost = "–", nan
    if item.distance > 0.0:
        low, high = item.needless_interval
        interval = f"{item.per_100km(item.needless):.1f} [{low:.1f}–{high:.1f}]"
        lost = item.per_100km(item.speed_lost)
    shares = f" [{100.0 * rate.low:.0f}–{100.0 * rate.high:.0f}]" if rate.n else ""
    errors = f" ({counted(item.errors, 'error')})" if item.errors else ""
    return [
        item.agent + errors,
        item.distance / 1000.0,
        interval,
        lost,
        item.brakes,
        f"{rate.k}/{rate.n}{shares}",
        item.avoidable - rate.n,
        item.unavoidable,
        item.contacts,
        item.caused,
        item.rear_ended,
        item.standing,
    ]


def _draw(stem: Path, summaries: Sequence[TrafficSummary]) -> None:
    """Draw the avoided share against the speed lost, and write the values beside the figure."""
    lines: list[list[object]] = []
    with saved_figure(stem.with_name(f"{stem.name}.svg"), 1, 1, figsize=(7.0, 4.2)) as (_, axis):
        for index, item in enumerate(summaries):
            rate, lost = item.avoided_by_brake, item.per_100km(item.speed_lost)
            if rate.n == 0:
                continue
            colour = COLOURS[index % len(COLOURS)]
            axis.plot([lost, lost], [rate.low, rate.high], color=colour, linewidth=1.2)
            axis.plot(lost, rate.k / rate.n, "o", color=colour, label=f"{item.agent}: {rate.k}/{rate.n}")
            lines.append([item.agent, f"{lost:.4f}", rate.k, rate.n, f"{rate.low:.4f}", f"{rate.high:.4f}"])
        axis.set_xscale("symlog", linthresh=10.0)
        highest = max(item.per_100km(item.speed_lost) for item in summaries)
        axis.set(xlim=(-0.5, max(2.0 * highest, 10.0)), ylim=(-0.02, 1.02))
        axis.set_xlabel("speed lost in needless brakes [m/s per 100 km]")
        axis.set_ylabel("contacts avoided by a needed brake")
        axis.legend(fontsize=8, loc="lower right")
    columns = ("agent", "speed_lost_per_100km", "avoided", "contacts", "low", "high")
    write_csv(stem.with_name(f"{stem.name}.csv"), columns, lines)
