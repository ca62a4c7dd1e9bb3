"""Write the gallery: an HTML page with its videos and pictures."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.config import DEFAULT_AGENTS
from lgmd_gym.camera.params import CONDITIONS
from lgmd_gym.processes.files import complete_folder
from lgmd_gym.report.gallery.cards import ScenarioCard, record_video, scenario_cards
from lgmd_gym.report.gallery.outcomes import evaluate_agents
from lgmd_gym.report.gallery.page import render_page
from lgmd_gym.report.gallery.stills import ROADS, camera_sheet, road_sheet


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
    outcomes = {}
    for number, card in enumerate(cards, 1):
        record_video(card, agent, media / card.name)
        outcomes[card.name] = evaluate_agents(card, agents, seeds)
        text = "traffic" if card.traffic else outcomes[card.name][agent].text
        on_progress(f"{number}/{len(cards)}  {card.target}: {text}")
    sheets = {}
    if with_sheets:
        on_progress("cameras and roads")
        sheets["cameras"] = _save_sheet(media, "camera", camera_sheet())
        sheets["roads"] = _save_sheet(media, "road", road_sheet(tuple(ROADS), tuple(CONDITIONS)))
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
