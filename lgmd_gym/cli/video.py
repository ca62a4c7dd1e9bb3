"""The `video` command."""

import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from lgmd_gym.benchmark.folder import provenance
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import Video
from lgmd_gym.cli.params import read_params
from lgmd_gym.errors import check_within
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.system.files import complete_folder
from lgmd_gym.video.clips import tables
from lgmd_gym.video.clips.anticipation import ScoredClip, anticipation
from lgmd_gym.video.clips.batch import (
    ClipJob,
    ClipResult,
    detect_from_trace,
    make_jobs,
    process_clip,
    scored_from_trace,
)
from lgmd_gym.video.clips.detection import ClipDetection
from lgmd_gym.video.clips.mcap_file import check_mcap
from lgmd_gym.video.clips.playback import PLAYBACK_CONFIGS, ClipRun, PlaybackConfig, named_config
from lgmd_gym.video.clips.score_tables import score_table, write_clip_scores, write_scores


def run(options: Video) -> int:
    """Process clips and print tables; return 2 if a clip is truncated, else 0."""
    if not options.clips:
        raise ValueError("a clip is required: pass video files or folders, as in lgmd-gym video CLIP.mp4")
    configs = _configs(options)
    check_within("--false-alarm-cap", options.false_alarm_cap, 0.0, 1.0)
    if options.mcap:
        check_mcap()
    jobs = make_jobs(options.clips, options.crashes, options.crash_frame, options.events)
    if options.events is not None and not any(job.event and job.event.event_s is not None for job in jobs):
        raise ValueError(f"{options.events} has no clip with an event; the scores need at least one event_s")
    print_notes(jobs, options.crashes or options.events, options.fps)
    for job in jobs:  # decode the first frame of each clip before creating the folder
        next(iter(ClipRun(job.clip, next(iter(configs.values())))))
    out = default_out(options.out, "video")
    with run_folder(out, {"clips": [job.clip for job in jobs], "configs": configs}) as folder:
        results = _process_all(options, jobs, configs, folder)
    make_console().print(f"traces and figures: {out}", soft_wrap=True)
    return print_errors(results)


def _process_all(
    options: Video, jobs: Sequence[ClipJob], configs: dict[str, PlaybackConfig], folder: Path
) -> list[ClipResult]:
    """Process the clips with every configuration, print the tables and return all results."""
    folders = make_clip_folders(folder, jobs)
    console, results, detections = make_console(), [], {}
    scored: dict[str, list[ScoredClip]] = {}
    for name, config in configs.items():
        suffix = f"-{name}" if len(configs) > 1 else ""
        batch = process_clips(
            jobs, folders, name, config, suffix,
            overlay=options.overlay, mcap=options.mcap, figure=options.plots,
        )  # fmt: skip
        results += batch
        rates = sorted({result.summary.fps for result in batch})
        description = ", ".join(config.describe(rate) for rate in rates[:3])
        console.print(Text.assemble((name, "bold"), f": {description}"), highlight=False)
        console.print(tables.clip_table(batch))
        detections[name] = detect_clips(jobs, batch)
        if detections[name]:
            console.print(tables.detection_table(f"{name}: {description}", detections[name]))
        scored[name] = score_clips(jobs, batch)
    if len(configs) > 1 and all(detections.values()):
        descriptions = {name: config.describe() for name, config in configs.items()}
        console.print(tables.config_table(detections, descriptions))
    if options.events is not None:
        scores = {name: anticipation(clips, options.false_alarm_cap) for name, clips in scored.items()}
        for name, result in scores.items():
            console.print(score_table(name, result))
        write_scores(folder / "scores.csv", scores)
        write_clip_scores(folder / "clip_scores.csv", scored, scores)
    return results


def print_notes(jobs: Sequence[ClipJob], annotations: Path | None, fps: float | None = None) -> None:
    """Print which clips are resampled and which have no annotation."""
    for job in jobs:
        if job.info.variable and fps is None:
            _note(f"{job.clip.name} has a variable frame rate; resampled to {job.info.fps:g} Hz")
        if annotations is not None and not job.annotated and job.event is None:
            _note(f"{job.clip.name} has no row in {annotations}; it is not in the table")


def default_out(out: Path | None, command: str) -> Path:
    """Return the folder of --out, or one named after the command and the time."""
    return out or Path("runs") / f"{command}-{time.strftime('%Y%m%d-%H%M%S')}"


@contextmanager
def run_folder(out: Path, settings: dict[str, Any]) -> Iterator[Path]:
    """Yield an unfinished run folder with `run.json`: the settings, versions and machine of the run."""
    with complete_folder(out, "run folder") as folder:
        text = json.dumps(settings | provenance(), indent=2, default=str)
        (folder / "run.json").write_text(text + "\n", encoding="utf-8")
        yield folder


def make_clip_folders(out: Path, jobs: Sequence[ClipJob]) -> list[Path]:
    """Create one folder per clip, numbered for clips of the same name."""
    folders = []
    for job in jobs:
        folder, number = out / job.clip.stem, 1
        while folder.exists():
            number += 1
            folder = out / f"{job.clip.stem}-{number}"
        folder.mkdir()
        folders.append(folder)
    return folders


def process_clips(
    jobs: Sequence[ClipJob], folders: Sequence[Path], name: str, config: PlaybackConfig, suffix: str,
    *, overlay: bool = False, mcap: bool = False, figure: bool = True,
) -> list[ClipResult]:  # fmt: skip
    """Process every clip with one configuration into its folder and show a progress bar."""
    results, frames_before = [], 0
    with progress_bar(name, sum(job.info.frames for job in jobs)) as set_progress:
        for job, folder in zip(jobs, folders, strict=True):

            def on_progress(fraction: float, before: int = frames_before, job: ClipJob = job) -> None:
                set_progress(before + fraction * job.info.frames)

            results.append(process_clip(
                job, config, folder, suffix=suffix, overlay=overlay, mcap=mcap, figure=figure,
                on_progress=on_progress,
            ))  # fmt: skip
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
        _note(f"{error}; the trace up to that frame is kept")
    return 2 if errors else 0


@contextmanager
def progress_bar(name: str, total: float) -> Iterator[Callable[[float], None]]:
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


def _configs(options: Video) -> dict[str, PlaybackConfig]:
    """Return the named configurations with the values of the other options."""
    names = tuple(PLAYBACK_CONFIGS) if options.configs == ("all",) else dict.fromkeys(options.configs)
    values: dict[str, Any] = {
        name: getattr(options, name) for name in ("fps", "size", "drop_duplicates", "roi")
    }
    params = read_params(options.params)
    if params is not None:
        values["params"] = LGMDParams.from_dict(params)
    given = {name: value for name, value in values.items() if value is not None}
    configs = {name: replace(named_config(name), **given) for name in names}
    if options.threshold is not None:
        for name, config in configs.items():
            configs[name] = replace(config, params=replace(config.params, t_sf=options.threshold))
    return configs


def _note(text: str) -> None:
    """Print a line to stderr."""
    print(f"lgmd-gym: {text}", file=sys.stderr)
