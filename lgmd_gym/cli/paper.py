"""The `paper` command."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from lgmd_gym.cli import clips
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import Paper
from lgmd_gym.clips import tables
from lgmd_gym.clips.batch import ClipJob, ClipResult, make_jobs
from lgmd_gym.clips.detection import ClipDetection
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
from lgmd_gym.paper import experiments
from lgmd_gym.paper.backgrounds import Panorama, Screen
from lgmd_gym.paper.claims import claim_table, evaluate_claims, write_claims
from lgmd_gym.paper.plots import paper_figures


def run(options: Paper) -> int:
    """Run the paper's experiments and print its claims; return 2 if a clip is truncated, else 0."""
    if options.realism:
        from lgmd_gym.cli import realism

        return realism.run(options)
    for name in ("clip_hfov_deg", "ignore_bottom", "night", "seeds", "worlds"):
        if getattr(options, name) != getattr(Paper, name):
            raise ValueError(f"--{name.replace('_', '-')} requires --realism")
    if (options.clips is None) != (options.crashes is None):
        raise ValueError(
            "--clips and --crashes must be used together: a folder, and a CSV with clip,crash_frame"
        )
    Panorama(picture=options.picture).render(0.0, Screen())  # check the image before creating the folder
    jobs = []
    if options.clips is not None:
        jobs = make_jobs([options.clips], options.crashes)
        clips.print_notes(jobs, options.crashes)
    settings = {"clips": [job.clip for job in jobs], "picture": options.picture}
    out = clips.default_out(options.out, "paper")
    with clips.run_folder(out, settings) as folder:
        clip_results = _experiments(options, jobs, folder)
    make_console().print(f"claims and figures: {out}", soft_wrap=True)
    return clips.print_errors(clip_results)


def _experiments(options: Paper, jobs: Sequence[ClipJob], folder: Path) -> list[ClipResult]:
    """Run the experiments, write the claims and figures, and return the results of the clips."""
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
    out: Path, jobs: Sequence[ClipJob], console: Console
) -> tuple[list[ClipResult], list[ClipDetection]]:
    """Process the clips with every configuration and print the tables.

    Returns:
        Results of all configurations, and the detections of the configuration `paper`.
    """
    folders = clips.make_clip_folders(out, jobs)
    results, detections = [], {}
    for name, config in PLAYBACK_CONFIGS.items():
        batch = clips.process_clips(jobs, folders, name, config, f"-{name}")
        results += batch
        detections[name] = clips.detect_clips(jobs, batch)
    descriptions = {name: config.describe() for name, config in PLAYBACK_CONFIGS.items()}
    for name in ("paper", "conservative"):
        console.print(tables.detection_table(f"{name}: {descriptions[name]}", detections[name]))
    console.print(tables.config_table(detections, descriptions))
    return results, detections["paper"]
