"""Scores of agents in all suites: plays the suites, writes CSV files, and fills the tables of the pages.

    python docs/experiments/results.py run runs/results --jobs 2
    python docs/experiments/results.py collect runs/results
    python docs/experiments/results.py pages

`run` plays the suites in 20 test worlds and traffic in more of them, one folder per suite; those whose folder
exists are not run again (complete an interrupted one with `lgmd-gym bench --resume FOLDER`). With `--agents`,
agents of your own are played in place of those of the pages. `collect` writes `docs/results/scores.csv` and
`traffic.csv`, in which results of other agents and suites stay; with `--print`, it prints tables instead.
`pages` fills every block

    <!-- table: KIND ARGUMENT … -->
    <!-- end of table -->

of the pages in Markdown from the CSV files: KIND is `avoided`, `false`, `detected` or `warned` with suites as
arguments and a line per agent, `cases` with suites and a line per case or family, `traffic`, or `summary` for
the agents of `IDEAS`; "–" stands for no result. The arguments after `:` are agents, all of them by default.
Intervals are at 95 % and cluster by case and world.
"""

import argparse
import csv
import re
import subprocess
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from lgmd_gym import benchmark
from lgmd_gym.benchmark import RunConfig
from lgmd_gym.benchmark.analysis.tables import rate_text
from lgmd_gym.benchmark.case import Row, is_traffic
from lgmd_gym.benchmark.plan import make_plan
from lgmd_gym.benchmark.protocols.car_to_car_2023 import SUFFIX
from lgmd_gym.benchmark.run_folder import StoredRun, read_run
from lgmd_gym.benchmark.summary import rate_of, without_fcw_driver
from lgmd_gym.benchmark.traffic.summary import traffic_summaries
from lgmd_gym.errors import check_known, counted
from lgmd_gym.processes.files import complete_file
from lgmd_gym.processes.pool import Executor
from lgmd_gym.statistics.intervals import Rate

DOCS = Path(__file__).parents[1]
SCORES, TRAFFIC = DOCS / "results" / "scores.csv", DOCS / "results" / "traffic.csv"
BOUND = "last-moment-oracle"  # the engine forecasts no traffic
AGENTS = (
    *("no-brake", "spike-threshold", "spike-threshold:threshold=158,frames=3", "danger-zone"),
    *("stopping-zone", "policy:all-round", "ttc-oracle", BOUND),
)
SEEDS = {
    "levels": 1,
    "r152": 20,
    "fmvss127": 5,
    "ncap2023": 1,
    "r152-vru": 5,
    "ncap2023-vru": 1,
    "fmvss127-pedestrian": 1,
    "everyday-threats": 2,
    "false-reaction": 5,
    "near-miss": 5,
    "everyday-neighbours": 2,
    "ncap2023-without-target": 1,
    "ncap2023-vru-without-target": 1,
    "traffic": 20,
    "traffic-inattentive": 20,
}
"""Seeds of each suite; those of traffic are per kind."""
FIRST_TRAFFIC_SEED = 110
BY_CASE = ("r152", "r152-vru")  # stated per case, since the regulation requires each of them
ALL = "all"
IDEAS = {
    "spike-threshold": ("the paper's rule: brake at 30 spikes/s", "one LGMD, a fixed 10° camera"),
    "stopping-zone": ("fields that follow the stopping distance", "17 LGMDs, speed, yaw rate"),
    "policy:all-round": ("a network that estimates the time to brake", "19 fields, speed, motion, brake"),
    BOUND: ("the bound: brakes at the last moment", "the true scene"),
}
"""Idea of an agent, and what it reads."""
SUMMARY = {
    "cars avoided": ("ncap2023", "avoided"),
    "pedestrians, bicycles avoided": ("ncap2023-vru", "avoided"),
    "everyday threats avoided": ("everyday-threats", "avoided"),
    "brakes without a threat": ("false-reaction", "false"),
}
"""Suite and measure of each column of the summary."""
KINDS = ("avoided", "false", "detected", "warned", "cases", "traffic", "summary")
BLOCK = re.compile(r"(<!-- table: (\w+)([^>]*?) -->\n).*?(<!-- end of table -->)", re.DOTALL)


class Score(NamedTuple):
    """A rate of one agent in a suite, or in one of its groups of cases."""

    suite: str
    group: str  # a case, a family, or "all"
    agent: str
    measure: str  # "avoided", "false", "warned" (cases with an FCW driver) or "detected"
    rate: Rate


class Drives(NamedTuple):
    """Results of one agent in a traffic suite."""

    suite: str
    agent: str
    km: float
    needless: int  # activations that are not needed
    low: float  # 95 % interval of their number per 1,000 km
    high: float
    speed_lost: float  # in these [m/s]
    met: int  # contacts that a needed brake can avoid, without those that vanish
    avoided: int
    contacts: int
    caused: int


def config_of(name: str, agents: Sequence[str]) -> RunConfig:
    """Return the run of a suite in the test worlds 8,000 to 8,019, or more of them in traffic."""
    suite, more = name, dict[str, Any]()
    if name == "levels":
        suite = str(Path(__file__).with_name("levels.toml"))
    if is_traffic(name):
        more |= {"first_seed": FIRST_TRAFFIC_SEED, "worlds": 1000}
        agents = [agent for agent in agents if agent != BOUND]
    return RunConfig(suite=suite, agents=tuple(agents), seeds=SEEDS[name], conditions=("mixed",), **more)


def play(folder: Path, agents: Sequence[str], suites: Sequence[str], jobs: int = 1) -> None:
    """Run the suites without a folder.

    Raises:
        ValueError: If a folder has a run of other agents.
    """
    if agents == [BOUND]:
        suites = [name for name in suites if not is_traffic(name)]
    configs = {name: config_of(name, agents) for name in suites}
    for name, config in configs.items():
        if (folder / name).exists():
            found = read_run(folder / name).config.agents
            if found != config.agents:
                raise ValueError(
                    f"the run in {str(folder / name)!r} has the agents {' '.join(found)}, "
                    f"not {' '.join(config.agents)}; choose another folder"
                )
    for name, config in configs.items():
        if not (folder / name).exists():
            benchmark.run(config, folder / name, Executor(jobs=jobs), plots=False, report=False)


def read(folder: Path) -> dict[str, StoredRun]:
    """Return the complete runs of a folder.

    Raises:
        ValueError: If there are none, or one lacks episodes or has failed ones, or the runs with and without
            targets differ in more than the suite.
    """
    runs = {name: read_run(folder / name) for name in SEEDS if (folder / name).exists()}
    if not runs:
        raise ValueError(f"no runs in {str(folder)!r}; play them first with results.py run {folder}")
    for name, run in runs.items():
        missing = make_plan(run.config).total - len(run.rows)
        if missing:
            raise ValueError(
                f"the run in {str(folder / name)!r} lacks {counted(missing, 'episode')}; "
                f"complete it with lgmd-gym bench --resume {folder / name}"
            )
        errors = sum(row["error"] is not None for row in run.rows)
        if errors:
            raise ValueError(
                f"the run in {str(folder / name)!r} has {counted(errors, 'failed episode')}; "
                "correct the agent and run the suite in another folder"
            )
        twin = runs.get(name + SUFFIX)
        if twin is not None and replace(twin.config, suite=run.config.suite) != run.config:
            raise ValueError(
                f"the runs in {str(folder / name)!r} and {str(folder / (name + SUFFIX))!r} differ in more "
                "than the suite; run both with the same agents in another folder"
            )
    return runs


def scores_of(runs: dict[str, StoredRun]) -> Iterator[Score]:
    """Yield the scores of the suites of cases."""
    for name, run in runs.items():
        if is_traffic(run.config.suite):
            continue
        twin = runs.get(name + SUFFIX)
        for agent in run.config.agents:
            rows: list[Row] = [row for row in run.rows if row["agent"] == agent]
            for group, part in groups(name, rows).items():
                yield from _rates(name, group, agent, part, twin)


def groups(suite: str, rows: Sequence[Row]) -> dict[str, list[Row]]:
    """Return the rows by case or family, and all of them."""
    parts: dict[str, list[Row]] = {ALL: list(rows)}
    for row in rows:
        group = row["case"].partition("/")[2] if suite in BY_CASE else row["family"]
        parts.setdefault(group, []).append(row)
    return parts


def _rates(
    suite: str, group: str, agent: str, rows: Sequence[Row], twin: StoredRun | None
) -> Iterator[Score]:
    usual = without_fcw_driver(rows)
    threats = [row for row in usual if row["threat"]]
    others = [row for row in usual if not row["threat"]]
    warned = [row for row in rows if row["fcw_driver"] and row["threat"]]
    measures: dict[str, tuple[list[Row], str]] = {
        "avoided": (threats, "avoided"),
        "false": (others, "false_activation"),
        "warned": (warned, "avoided"),
    }
    if twin is not None:
        quiet = {_key(row): row["false_activation"] is False for row in twin.rows}
        found = [{**row, "avoided": row["avoided"] and quiet[_key(row)]} for row in threats]
        measures["detected"] = (found, "avoided")  # pyright: ignore[reportArgumentType]
    for measure, (chosen, key) in measures.items():
        if chosen:
            yield Score(suite, group, agent, measure, rate_of(chosen, key))


def _key(row: Row) -> tuple[object, ...]:
    """Return what a row has in common with that of the same case without its target."""
    return row["agent"], row["case"].partition("/")[2], row["seed"], row["condition"], row["world"]


def drives_of(runs: dict[str, StoredRun]) -> Iterator[Drives]:
    """Yield the results in traffic."""
    for name, run in runs.items():
        if not is_traffic(run.config.suite):
            continue
        for item in traffic_summaries(run.rows):
            low, high = (10.0 * bound for bound in item.needless_interval)
            yield Drives(
                name,
                item.agent,
                item.distance / 1000.0,
                item.needless,
                low,
                high,
                item.speed_lost,
                item.avoided_by_brake.n,
                item.avoided_by_brake.k,
                item.contacts,
                item.caused,
            )


def write(path: Path, heads: Sequence[str], lines: Iterable[Iterable[object]], commit: str) -> None:
    """Write results into a CSV file, with the commit of the package that was run.

    Results of other suites or agents in the file stay.
    """
    suite, agent = heads.index("suite"), heads.index("agent")
    new = [[*map(str, line), commit] for line in lines]
    played = {(line[suite], line[agent]) for line in new}
    old = _lines(path) if path.exists() else []
    kept = [line for line in old if (line[suite], line[agent]) not in played]
    rows = kept + new
    suites, agents = list(SEEDS), [*AGENTS, *(row[agent] for row in rows)]
    rows.sort(key=lambda row: (suites.index(row[suite]), agents.index(row[agent])))  # groups stay in order
    path.parent.mkdir(exist_ok=True)
    with complete_file(path) as part, part.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*heads, "commit"])
        writer.writerows(rows)


def write_scores(scores: Iterable[Score], commit: str) -> None:
    """Write the file of scores; bounds are in per cent."""
    lines = (
        (
            *score[:4],
            score.rate.k,
            score.rate.n,
            f"{100 * score.rate.low:.3f}",
            f"{100 * score.rate.high:.3f}",
        )
        for score in scores
    )
    write(SCORES, (*Score._fields[:4], "k", "n", "low", "high"), lines, commit)


def write_traffic(drives: Iterable[Drives], commit: str) -> None:
    """Write the file of results in traffic."""
    lines = ([f"{value:.1f}" if isinstance(value, float) else value for value in item] for item in drives)
    write(TRAFFIC, Drives._fields, lines, commit)


def read_scores() -> list[Score]:
    """Return the scores in the file."""
    return [
        Score(*values, Rate(int(k), int(n), float(low) / 100, float(high) / 100))  # pyright: ignore[reportCallIssue]
        for *values, k, n, low, high, _ in _lines(SCORES)
    ]


def read_traffic() -> list[Drives]:
    """Return the results in traffic in the file."""
    types = Drives.__annotations__.values()
    return [
        Drives(*(kind(value) for kind, value in zip(types, line, strict=True)))
        for *line, _ in _lines(TRAFFIC)
    ]


def _lines(path: Path) -> list[list[str]]:
    if not path.exists():
        raise ValueError(f"no file {str(path)!r}; write it first with results.py collect FOLDER")
    with path.open(newline="") as file:
        heads, *lines = csv.reader(file)
    if heads[-1] != "commit":
        raise ValueError(f"{str(path)!r} has another format; remove it and collect the runs of all agents")
    return lines


def check_twins(suites: Collection[str]) -> None:
    """Raise ValueError for a suite without its twin: their results would come from different runs."""
    pairs = {name: name + SUFFIX for name in SEEDS if name + SUFFIX in SEEDS}
    for name, twin in pairs.items():
        if (name in suites) != (twin in suites):
            raise ValueError(
                f"collect requires the runs of both {name!r} and {twin!r}; play the other one, too"
            )


def table(
    kind: str, arguments: Sequence[str], scores: Sequence[Score], drives: Sequence[Drives]
) -> list[str]:
    """Return the lines of a table in Markdown.

    Args:
        kind: See the module.
        arguments: Suites, then ":" and agents if not all of them.
        scores: The scores.
        drives: The results in traffic.

    Raises:
        ValueError: For an unknown kind, or without results for an argument.
    """
    check_known("kind of table", kind, KINDS)
    if kind == "summary":
        return summary_table(scores, drives)
    split = arguments.index(":") if ":" in arguments else len(arguments)
    suites, agents = list(arguments[:split]), list(arguments[split + 1 :])
    results = drives if kind == "traffic" else scores
    known = list(dict.fromkeys(item.agent for item in results))
    for name in agents:
        check_known("agent of the results", name, known)
    for name in suites:
        check_known("suite of the results", name, list(dict.fromkeys(item.suite for item in results)))
    agents = agents or known
    if kind == "traffic":
        return traffic_table([item for item in drives if item.agent in agents])
    cells = {score[:4]: rate_text(score.rate) for score in scores}
    if kind != "cases":
        lines = [
            [f"`{agent}`", *(cells.get((suite, ALL, agent, kind), "–") for suite in suites)]
            for agent in agents
        ]
        return markdown([["agent", *suites], *lines])
    if not suites:
        raise ValueError("a table of cases requires suites; add them before the colon")
    lines = [["case" if suites[0] in BY_CASE else "family", *(f"`{agent}`" for agent in agents)]]
    rows = dict.fromkeys(score[:2] for score in scores if score.suite in suites and score.group != ALL)
    for suite, group in rows:
        values = (
            next((cells[key] for key in _keys(suite, group, agent) if key in cells), "–") for agent in agents
        )
        lines.append([group, *values])
    return markdown(lines)


def _keys(suite: str, group: str, agent: str) -> Iterator[tuple[str, str, str, str]]:
    return ((suite, group, agent, measure) for measure in ("avoided", "false"))


def summary_table(scores: Sequence[Score], drives: Sequence[Drives]) -> list[str]:
    """Return the table of the start page."""
    rates = {(score.agent, score.suite, score.measure): score.rate for score in scores if score.group == ALL}
    needless = {item.agent: item for item in drives if item.suite == "traffic"}
    lines = [["agent", "idea", *SUMMARY, "needless brakes in traffic", "reads"]]
    for agent, (idea, reads) in IDEAS.items():
        columns = [rates.get((agent, *column)) for column in SUMMARY.values()]
        cells = [f"{rate.k} of {rate.n}" if rate else "–" for rate in columns]
        drive = needless.get(agent)
        cells.append(f"{drive.needless} in {drive.km:.0f} km" if drive else "–")
        lines.append([f"`{agent}`", idea, *cells, reads])
    return markdown(lines)


def traffic_table(drives: Sequence[Drives]) -> list[str]:
    """Return the table of results in traffic."""
    lines = [
        [
            *("suite", "agent", "km", "needless activations per 1,000 km", "speed lost [m/s] per 100 km"),
            *("avoided by a needed brake", "contacts", "caused"),
        ]
    ]
    for item in drives:
        rate = f"{1000 * item.needless / item.km:.0f} [{item.low:.0f}–{item.high:.0f}]"
        lost = f"{100 * item.speed_lost / item.km:.0f}"
        avoided = f"{item.avoided}/{item.met}" if item.met else "–"
        lines.append(
            [item.suite, f"`{item.agent}`", f"{item.km:.0f}", rate, lost, avoided, *map(str, item[-2:])]
        )
    return markdown(lines)


def markdown(lines: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a Markdown table, the heading first."""
    first, *others = lines
    return [f"| {' | '.join(line)} |" for line in (first, ["---"] * len(first), *others)]


def filled(text: str, make: Callable[[str, Sequence[str]], list[str]]) -> str:
    """Return the text of a page with its tables."""

    def block(match: re.Match[str]) -> str:
        start, kind, arguments, end = match.groups()
        return start + "\n".join(["", *make(kind, arguments.split()), "", end])

    return BLOCK.sub(block, text)


def fill_pages(check: bool = False) -> list[Path]:
    """Fill the tables of all pages and return the pages that differ; `check` writes nothing."""
    scores, drives = read_scores(), read_traffic()
    pages = [DOCS.parent / "README.md", *sorted(DOCS.glob("*.md")), *sorted((DOCS / "cards").glob("*.md"))]
    changed: list[Path] = []
    for page in pages:
        text = page.read_text()
        new = filled(text, lambda kind, arguments: table(kind, arguments, scores, drives))
        if new != text:
            changed.append(page)
            if not check:
                page.write_text(new)
    return changed


def main() -> None:
    """Run, collect or fill the pages, as the arguments say."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("command", choices=("run", "collect", "pages"))
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--agents", nargs="+", default=AGENTS)
    parser.add_argument("--suites", nargs="+", choices=list(SEEDS), default=list(SEEDS))
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--print", action="store_true", help="print tables, and write no file")
    options = parser.parse_args()
    if options.command == "pages":
        print(*fill_pages(), sep="\n")
        return
    if options.folder is None:
        parser.error(f"{options.command} requires the folder of the runs")
    if options.command == "run":
        play(options.folder, options.agents, options.suites, options.jobs)
        return
    runs = read(options.folder)
    scores, drives = list(scores_of(runs)), list(drives_of(runs))
    if options.print:
        for measure in ("avoided", "false"):
            suites = list(dict.fromkeys(s.suite for s in scores if s.measure == measure))
            print(*table(measure, suites, scores, drives), "", sep="\n")
        print(*traffic_table(drives), sep="\n")
        return
    check_twins(runs)
    git = ["git", "rev-parse", "--short", "HEAD"]
    commit = subprocess.run(git, capture_output=True, text=True, check=True).stdout.strip()
    write_scores(scores, commit)
    write_traffic(drives, commit)


if __name__ == "__main__":
    try:
        main()
    except ValueError as error:
        sys.exit(str(error))
