"""A comparison of neuron models: settings, measurements and the report."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path

from lgmd_gym.camera import Camera
from lgmd_gym.clips.batch import ClipJob
from lgmd_gym.comparison import clips, cost, sections, simulation, stimuli
from lgmd_gym.comparison.models import PAGE_MODELS, checked_models
from lgmd_gym.comparison.simulation import Worlds
from lgmd_gym.errors import check_known, check_within
from lgmd_gym.report.document import Document, Section

PARTS = ("cost", "stimuli", "clips", "simulation")
Progress = Callable[[str], AbstractContextManager[object]]


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """Settings of a comparison.

    Attributes:
        models: Specifications of the models; the first one is the reference of differences.
        parts: Parts of the report, of `PARTS`; clips only with `clip_jobs`.
        worlds: Episodes that choose the thresholds.
        test: Episodes that are played once with these thresholds; None for none.
        clip_jobs: Clips with known crashes.
        clip_fps: Frame rate to resample clips to [Hz]; None for that of each clip.
        clip_cap: Highest share of earlier frames of clips in alarm.
        quick: Whether the cost is measured in fewer rounds.
        jobs: Number of processes.

    Raises:
        ValueError: For an unknown model, option, part or camera, or a value out of range.
    """

    models: tuple[str, ...] = PAGE_MODELS
    parts: tuple[str, ...] = PARTS
    worlds: Worlds = field(default_factory=Worlds)
    test: Worlds | None = None
    clip_jobs: tuple[ClipJob, ...] = ()
    clip_fps: float | None = None
    clip_cap: float = 0.1
    quick: bool = False
    jobs: int = 1

    def __post_init__(self) -> None:
        shape = Camera.make(self.worlds.camera).shape
        object.__setattr__(self, "models", checked_models(self.models, shape))
        for part in self.parts:
            check_known("part", part, PARTS)
        check_within("clip_cap", self.clip_cap, 0.0, 1.0)
        if self.clip_jobs:
            clips.check_jobs(self.clip_jobs)


def compare(settings: Comparison, folder: Path, on_part: Progress) -> Document:
    """Measure the models, and write figures and the report into a folder; return the report.

    Args:
        settings: Models and parts.
        folder: Existing folder.
        on_part: Returns a context manager around each part, given its description.
    """
    parts: list[Section] = []
    if "stimuli" in settings.parts:
        with on_part("stimuli"):
            parts.append(sections.of_stimuli(stimuli.run_stimuli(settings.models), folder))
    if "clips" in settings.parts and settings.clip_jobs:
        with on_part("clips"):
            responses = clips.run_clips(settings.models, settings.clip_jobs, settings.clip_fps)
            parts.append(
                sections.of_clips(
                    clips.score_clips(responses, settings.clip_cap), responses, settings.clip_cap, folder
                )
            )
    if "simulation" in settings.parts:
        parts += _simulation(settings, folder, on_part)
    if "cost" in settings.parts:
        with on_part("cost"):
            rounds = 3 if settings.quick else 15
            parts.append(sections.of_cost(cost.measure(settings.models, rounds)))
    document = Document("Which neuron?", sections.introduction(settings.models), tuple(parts))
    document.write(folder)
    return document


def _simulation(settings: Comparison, folder: Path, on_part: Progress) -> list[Section]:
    """Return the sections on validation worlds, and on test worlds if there are any."""
    found: list[Section] = []
    with on_part("open loop, validation worlds"):
        recordings = simulation.record(settings.worlds, settings.models, settings.jobs)
        curves = simulation.curves(recordings)
        chosen = simulation.choose(curves)
        pairs = simulation.pairs(chosen, recordings)
    with on_part("closed loop, validation worlds"):
        driven = simulation.closed_loop(chosen, recordings, settings.worlds.camera, settings.jobs)
    found.append(sections.of_simulation("validation", settings.worlds, curves, chosen, pairs, driven, folder))
    if settings.test is None:
        return found
    with on_part("open loop, test worlds"):
        recordings = simulation.record(settings.test, settings.models, settings.jobs)
        applied = simulation.apply(chosen, recordings)
        pairs = simulation.pairs(applied, recordings)
    with on_part("closed loop, test worlds"):
        driven = simulation.closed_loop(applied, recordings, settings.test.camera, settings.jobs)
    found.append(sections.of_simulation("test", settings.test, {}, applied, pairs, driven, folder))
    return found
