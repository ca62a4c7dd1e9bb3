"""The `paper` command; the attribute docstrings of `Paper` are its help texts."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import File, default_out

if TYPE_CHECKING:
    from lgmd_gym.clips.batch import ClipJob, ClipResult
    from lgmd_gym.clips.detection import ClipDetection


@dataclass(frozen=True, kw_only=True)
class Paper:
    """Repeat the experiments of the LGMD paper; write figures and a table of its claims.

    The paper's crash and near-miss clips are not included in this package; pass a folder of your own.
    """

    out: File = None
    """Run folder; must not exist. Default: runs/paper-DATE-TIME."""
    clips: File = None
    """Folder of driving clips; requires --crashes."""
    crashes: File = None
    """CSV file with the columns clip,crash_frame (empty for no crash)."""
    picture: File = None
    """Image for the shifting panorama. Default: a random image with a natural spectrum."""


def run(options: Paper) -> int:
    """Run the paper's experiments and print its claims; return 2 if a clip is truncated, else 0."""
    if (options.clips is None) != (options.crashes is None):
        raise ValueError(
            "--clips and --crashes must be used together: a folder, and a CSV with clip,crash_frame"
        )
    from lgmd_gym.cli import clips
    from lgmd_gym.clips.batch import make_jobs
    from lgmd_gym.paper.backgrounds import Panorama, Screen

    Panorama(picture=options.picture).render(0.0, Screen())  # check the image before creating the folder
    jobs = []
    if options.clips is not None:
        jobs = make_jobs([options.clips], options.crashes)
        clips.print_notes(jobs, options.crashes)
    settings = {"clips": [job.clip for job in jobs], "picture": options.picture}
    out = default_out(options.out, "paper")
    with clips.run_folder(out, settings) as folder:
        clip_results = _experiments(options, jobs, folder)
    make_console().print(f"claims and figures: {out}", soft_wrap=True)
    return clips.print_errors(clip_results)


def _experiments(options: Paper, jobs: "Sequence[ClipJob]", folder: Path) -> "list[ClipResult]":
    """Run the experiments, write the claims and figures, and return the results of the clips."""
    from lgmd_gym.cli import clips
    from lgmd_gym.paper import experiments
    from lgmd_gym.paper.claims import claim_table, evaluate_claims, write_claims
    from lgmd_gym.paper.plots import paper_figures

    with clips.progress_bar("paper", experiments.STEPS) as set_progress:
        steps = iter(range(1, experiments.STEPS + 1))
        results = experiments.run_experiments(lambda: set_progress(next(steps)), options.picture)
    console, clip_results, detections = make_console(), [], None
    if jobs:
        clip_results, detections = _process_all_configs(folder, jobs, console)
    claims = evaluate_claims(results, detections)
    write_claims(claims, folder)
    paper_figures(results, folder)
    console.print(claim_table(claims))
    return clip_results


def _process_all_configs(
    out: Path, jobs: "Sequence[ClipJob]", console: Console
) -> "tuple[list[ClipResult], list[ClipDetection]]":
    """Process the clips with every configuration; return all results, and the detections of `paper`."""
    from lgmd_gym.cli import clips
    from lgmd_gym.clips import tables
    from lgmd_gym.clips.playback import PLAYBACK_CONFIGS

    folders = clips.make_clip_folders(out, jobs)
    results: list[ClipResult] = []
    detections: dict[str, list[ClipDetection]] = {}
    for name, config in PLAYBACK_CONFIGS.items():
        batch = clips.process_clips(jobs, folders, name, config, f"-{name}")
        results += batch
        detections[name] = clips.detect_clips(jobs, batch)
    descriptions = {name: config.describe() for name, config in PLAYBACK_CONFIGS.items()}
    for name in ("paper", "conservative"):
        console.print(tables.detection_table(f"{name}: {descriptions[name]}", detections[name]))
    console.print(tables.config_table(detections, descriptions))
    return results, detections["paper"]
