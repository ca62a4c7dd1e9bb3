"""`lgmd-gym gallery`: a static page of films of every scenario, with what each agent makes of it."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

import lgmd_gym  # noqa: F401  (registers the ids)
from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.folder import new_folder
from lgmd_gym.benchmark.config import DEFAULT_AGENTS
from lgmd_gym.camera.params import CONDITIONS
from lgmd_gym.gallery.page import page
from lgmd_gym.gallery.scenes import film, find_scenes, judge
from lgmd_gym.gallery.stills import ROADS, lens_sheet, road_sheet


def make_gallery(
    out: Path, names: tuple[str, ...], agent: str, seeds: int, tell: Callable[[str], object] = print
) -> Path:
    """Make the page and everything on it.

    Args:
        out: The folder, which must not exist.
        names: Scenario families or kinds of traffic; none for all, with the sheets of lenses and roads.
        agent: Who brakes in the films.
        seeds: Seeds per scene that the agents are judged by.
        tell: Called with a line about each scene.

    Returns:
        The path of `index.html`.

    Raises:
        ValueError: For an unknown name, `seeds` below 1, or a folder that exists or cannot be made.
    """
    scenes = find_scenes(names)
    make_agent(agent)
    if seeds < 1:
        raise ValueError(f"seeds must be >= 1, got {seeds}")
    media = new_folder(out, "gallery folder") / "media"
    media.mkdir()
    agents = list(dict.fromkeys([*DEFAULT_AGENTS, agent]))
    verdicts = {}
    for number, scene in enumerate(scenes, 1):
        film(scene, agent, media / scene.name)
        verdicts[scene.name] = judge(scene, agents, seeds)
        said = verdicts[scene.name].get(agent, "traffic")
        tell(f"{number}/{len(scenes)}  {scene.target}: {said}")
    sheets = {}
    if not names:
        tell("lenses and roads")
        sheets["lenses"] = _save_sheet(media, "lens", lens_sheet())
        sheets["roads"] = _save_sheet(media, "road", road_sheet(tuple(ROADS), tuple(CONDITIONS)))
    index = out / "index.html"
    index.write_text(page(scenes, verdicts, sheets, agent, seeds), encoding="utf-8")
    return index


def _save_sheet(media: Path, stem: str, sheet: dict[str, dict[str, np.ndarray]]) -> dict[str, dict[str, str]]:
    """Save every frame of a sheet and return row to column to its file's name."""
    files: dict[str, dict[str, str]] = {}
    for row, frames in sheet.items():
        files[row] = {column: f"{stem}-{row}-{column}.png" for column in frames}
        for column, frame in frames.items():
            Image.fromarray(frame).save(media / files[row][column], optimize=True)
    return files
