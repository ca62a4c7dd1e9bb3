"""The gallery: outcomes of agents, the page from `gallery.html`, and its files."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple, cast

import numpy as np
from markupsafe import Markup, escape
from PIL import Image

import lgmd_gym  # noqa: F401  (registers the ids)  # pyright: ignore[reportUnusedImport]
from lgmd_gym._version import __version__
from lgmd_gym.agents import make_agent
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.case import Case, Row, relative_impact
from lgmd_gym.benchmark.config import DEFAULT_AGENTS
from lgmd_gym.benchmark.player import run_task
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.task import NO_BRAKE, Task
from lgmd_gym.camera import WEATHERS
from lgmd_gym.envs.registration import RANDOM, RANDOM_TASKS
from lgmd_gym.processes.files import complete_folder
from lgmd_gym.report.gallery.cards import (
    ROADS,
    ScenarioCard,
    camera_sheet,
    record_video,
    road_sheet,
    scenario_cards,
)


class AgentOutcome(NamedTuple):
    """Result of an agent over the seeds of a scenario."""

    text: str  # result in words
    passed: bool  # whether every threat was avoided, and no episode had a false activation or an error
    threat: bool  # whether the scenario is a threat in any of the episodes

    @classmethod
    def of(cls, rows: Sequence[Row]) -> "AgentOutcome":
        """Return the outcome of the rows of one agent."""
        threats = [row for row in rows if row["threat"]]
        if any(row["error"] is not None for row in rows):
            return cls("failed", False, bool(threats))
        non_threats = [row for row in rows if not row["threat"]]
        parts: list[str] = []
        if threats:
            parts.append(f"avoided {sum(row['avoided'] for row in threats)}/{len(threats)}")
            impacts = [3.6 * relative_impact(row) for row in threats if row["collision"]]
            if impacts:
                parts.append(f"contact at {median(impacts):.0f} km/h")
            if any(row["premature_brake"] for row in threats):
                parts.append("braked too early")
        if non_threats:
            contacts = sum(row["collision"] for row in non_threats)
            false_activations = sum(row["false_activation"] for row in non_threats)
            parts.append(f"false activations {false_activations}/{len(non_threats)}")
            if contacts:
                parts.append(f"contact {contacts}/{len(non_threats)}")
        passed = all(row["avoided"] for row in threats) and not any(
            row["false_activation"] or row["collision"] for row in non_threats
        )
        return cls(", ".join(parts), passed, bool(threats))


def evaluate_agents(card: ScenarioCard, agents: Sequence[str], seeds: int) -> dict[str, AgentOutcome]:
    """Return the outcome of each agent and of no-brake; empty for traffic."""
    if card.traffic:
        return {}
    task = RANDOM_TASKS.get(card.name)
    arguments, environment = (tuple(task.arguments.items()), RANDOM) if task else ((), "")
    case = Case("gallery", card.name, "default", arguments, environment)
    results = [run_task(Task(NO_BRAKE, case, seed, SensorConfig())) for seed in range(seeds)]
    outcomes = {NO_BRAKE: AgentOutcome.of([result.row for result in results])}
    for agent in agents:
        if agent != NO_BRAKE:
            tasks = [
                Task(agent, case, seed, SensorConfig(), result.counterfactual)
                for seed, result in enumerate(results)
            ]
            outcomes[agent] = AgentOutcome.of([run_task(task).row for task in tasks])
    return outcomes


ImageSheet = Mapping[str, Mapping[str, str]]  # row -> column -> file name


def render_page(
    cards: Sequence[ScenarioCard],
    outcomes: Mapping[str, Mapping[str, AgentOutcome]],
    sheets: Mapping[str, ImageSheet],
    agent: str,
    seeds: int,
) -> str:
    """Return the page as HTML."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("lgmd_gym.report.gallery", "."), autoescape=True, undefined=StrictUndefined
    )
    cast(Values, environment.filters).update(code=_code, paragraphs=_paragraphs)
    groups: dict[str, list[ScenarioCard]] = {"threats": [], "non-threats": [], "traffic": []}
    for card in cards:
        groups[_group(card, outcomes[card.name])].append(card)
    example = next((card.name for card in cards if card.name == "CCRs"), cards[0].name)
    return environment.get_template("gallery.html").render(
        groups=groups,
        outcomes=outcomes,
        sheets=sheets,
        agent=agent,
        seeds=seeds,
        example=example,
        version=__version__,
    )


def _group(card: ScenarioCard, outcomes: Mapping[str, AgentOutcome]) -> str:
    """Return the section of a card; a threat is a scenario in which no-brake has contact."""
    if card.traffic:
        return "traffic"
    return "threats" if outcomes["no-brake"].threat else "non-threats"


def _code(text: str) -> Markup:
    """Return docstring text as HTML, with text in backticks as code."""
    return Markup(re.sub(r"`+([^`]+)`+", r"<code>\1</code>", str(escape(" ".join(text.split())))))


def _paragraphs(text: str) -> list[str]:
    """Return the paragraphs of a docstring without its headings."""
    return [part for part in text.split("\n\n") if part.strip() and not part.startswith("#")]


def make_gallery(
    out: Path,
    names: tuple[str, ...] = (),
    agent: str = "spike-threshold",
    seeds: int = 3,
    on_progress: Callable[[str], object] = print,
) -> Path:
    """Write the gallery.

    Args:
        out: Folder, which must not exist.
        names: Scenario families or kinds of traffic; empty for all, and the sheets of cameras and roads.
        agent: Agent in the videos.
        seeds: Number of seeds per scenario for the outcomes.
        on_progress: Function called with a line of text after each scenario.

    Returns:
        The path of `index.html`.

    Raises:
        ValueError: For an unknown name, `seeds` below 1, or a folder that exists or cannot be created.
    """
    cards = scenario_cards(names)
    make_agent(agent)  # raises for an unknown agent before the folder is created
    if seeds < 1:
        raise ValueError(f"seeds must be >= 1, got {seeds}")
    with complete_folder(out, "gallery folder") as folder:
        _write(folder, cards, not names, agent, seeds, on_progress)
    return out / "index.html"


def _write(
    folder: Path,
    cards: Sequence[ScenarioCard],
    with_sheets: bool,
    agent: str,
    seeds: int,
    on_progress: Callable[[str], object],
) -> None:
    """Write the page, its videos and pictures to a folder."""
    media = folder / "media"
    media.mkdir()
    agents = list(dict.fromkeys([*DEFAULT_AGENTS, agent]))
    outcomes: dict[str, dict[str, AgentOutcome]] = {}
    for number, card in enumerate(cards, 1):
        record_video(card, agent, media / card.name)
        outcomes[card.name] = evaluate_agents(card, agents, seeds)
        text = "traffic" if card.traffic else outcomes[card.name][agent].text
        on_progress(f"{number}/{len(cards)}  {card.target}: {text}")
    sheets: dict[str, ImageSheet] = {}
    if with_sheets:
        on_progress("cameras and roads")
        sheets["cameras"] = _save_sheet(media, "camera", camera_sheet())
        sheets["roads"] = _save_sheet(media, "road", road_sheet(tuple(ROADS), tuple(WEATHERS)))
    page = render_page(cards, outcomes, sheets, agent, seeds)
    (folder / "index.html").write_text(page, encoding="utf-8")


def _save_sheet(media: Path, stem: str, sheet: dict[str, dict[str, np.ndarray]]) -> dict[str, dict[str, str]]:
    """Save every frame of a sheet and return the file names by row and column."""
    files: dict[str, dict[str, str]] = {}
    for row, frames in sheet.items():
        files[row] = {column: f"{stem}-{row}-{column}.png" for column in frames}
        for column, frame in frames.items():
            Image.fromarray(frame).save(media / files[row][column], optimize=True)
    return files
