"""Common parts of the commands that process clips: run folder, progress bar, notes."""

import json
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.config import provenance
from lgmd_gym.cli.console import note
from lgmd_gym.clips.batch import (
    ClipJob,
    ClipResult,
    detect_from_trace,
    process_clip,
    scored_from_trace,
)
from lgmd_gym.clips.detection import ClipDetection
from lgmd_gym.clips.playback import PlaybackConfig
from lgmd_gym.clips.scores import ScoredClip
from lgmd_gym.processes.files import complete_folder


def print_notes(jobs: Sequence[ClipJob], annotations: Path | None, fps: float | None = None) -> None:
    """Print which clips are resampled and which have no annotation."""
    for job in jobs:
        if job.info.variable and fps is None:
            note(f"{job.clip.name} has a variable frame rate; resampled to {job.info.fps:g} Hz")
        if annotations is not None and not job.annotated and job.event is None:
            note(f"{job.clip.name} has no row in {annotations}; it is not in the table")


@contextmanager
def run_folder(out: Path, settings: Values) -> Generator[Path, None, None]:
    """Yield an unfinished run folder with `run.json`: the settings, versions and machine of the run."""
    with complete_folder(out, "run folder") as folder:
        text = json.dumps(settings | provenance(), indent=2, default=str)
        (folder / "run.json").write_text(text + "\n", encoding="utf-8")
        yield folder


def make_clip_folders(out: Path, jobs: Sequence[ClipJob]) -> list[Path]:
    """Create one folder per clip, numbered for clips of the same name."""
    folders: list[Path] = []
    for job in jobs:
        folder, number = out / job.clip.stem, 1
        while folder.exists():
            number += 1
            folder = out / f"{job.clip.stem}-{number}"
        folder.mkdir()
        folders.append(folder)
    return folders


def process_clips(
    jobs: Sequence[ClipJob],
    folders: Sequence[Path],
    name: str,
    config: PlaybackConfig,
    suffix: str,
    *,
    overlay: bool = False,
    figure: bool = True,
) -> list[ClipResult]:
    """Process every clip with one configuration into its folder and show a progress bar."""
    results: list[ClipResult] = []
    frames_before = 0
    with progress_bar(name, sum(job.info.frames for job in jobs)) as set_progress:
        for job, folder in zip(jobs, folders, strict=True):

            def on_progress(fraction: float, before: int = frames_before, job: ClipJob = job) -> None:
                set_progress(before + fraction * job.info.frames)

            results.append(
                process_clip(
                    job,
                    config,
                    folder,
                    suffix=suffix,
                    overlay=overlay,
                    figure=figure,
                    on_progress=on_progress,
                )
            )
            frames_before += job.info.frames
        set_progress(frames_before)
    return results


def detect_clips(jobs: Sequence[ClipJob], results: Sequence[ClipResult]) -> list[ClipDetection]:
    """Return the detections of the annotated clips."""
    return [
        detect_from_trace(job, result) for job, result in zip(jobs, results, strict=True) if job.annotated
    ]


def score_clips(jobs: Sequence[ClipJob], results: Sequence[ClipResult]) -> list[ScoredClip]:
    """Return the scores of the clips with a known event or none; truncated clips are left out."""
    return [
        scored_from_trace(job, job.event, result)
        for job, result in zip(jobs, results, strict=True)
        if job.event is not None and not result.error
    ]


def print_errors(results: Sequence[ClipResult]) -> int:
    """Print the errors of truncated clips; return 2 if there are any, else 0."""
    errors = dict.fromkeys(result.error for result in results if result.error)
    for error in errors:
        note(f"{error}; the trace up to that frame is kept")
    return 2 if errors else 0


@contextmanager
def progress_bar(name: str, total: float) -> Generator[Callable[[float], None], None, None]:
    """Show a progress bar on stderr and yield the function that sets its value."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=total)
        yield lambda completed: bar.update(task, completed=completed)
