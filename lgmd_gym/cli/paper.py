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

    The paper's crash and near-miss clips are not part of this package. With --clips and without --crashes,
    those in a folder of yours are recognised by the SHA-256 of the files, and this package's annotation of
    their crashes applies; nothing is downloaded.
    """

    out: File = None
    """Run folder; must not exist. Default: runs/paper-DATE-TIME."""
    clips: File = None
    """Folder with driving clips: the published ones, or your own with --crashes."""
    crashes: File = None
    """CSV file with the columns clip,crash_frame (empty for no crash) for clips of your own."""
    picture: File = None
    """Image for the shifting panorama. Default: a random image with a natural spectrum."""


def run(options: Paper) -> int:
    """Run the paper's experiments and print its claims; return 2 if a clip is truncated, else 0."""
    if options.crashes is not None and options.clips is None:
        raise ValueError(f"--crashes {options.crashes} annotates clips: add --clips with their folder")
    from lgmd_gym.cli import clips
    from lgmd_gym.paper.backgrounds import Panorama, Screen

    Panorama(picture=options.picture).render(0.0, Screen())  # check the image before creating the folder
    jobs = [] if options.clips is None else _jobs(options.clips, options.crashes)
    settings = {"clips": [job.clip for job in jobs], "picture": options.picture}
    out = default_out(options.out, "paper")
    with clips.run_folder(out, settings) as folder:
        clip_results = _experiments(options, jobs, folder)
    make_console().print(f"claims and figures: {out}", soft_wrap=True)
    return clips.print_errors(clip_results)


def _jobs(folder: Path, crashes: Path | None) -> "list[ClipJob]":
    """Return the clips of a folder: those of an annotation of the user, or the published ones."""
    from lgmd_gym.cli import clips
    from lgmd_gym.clips.batch import make_jobs
    from lgmd_gym.clips.published import find_published, published_clips

    if crashes is not None:
        jobs = make_jobs([folder], crashes)
        clips.print_notes(jobs, crashes)
        unique = len({job.name for job in jobs}) == len(jobs)
        return jobs if unique else [job._replace(title=job.clip.name) for job in jobs]
    files = find_published(folder)
    for path in files.unknown:
        clips.note(f"{path.name} is none of the published clips (by SHA-256); left out")
    if files.missing:
        names = ", ".join(clip.name for clip in files.missing)
        clips.note(f"{len(files.missing)} of {len(published_clips())} published clips are missing: {names}")
    return files.jobs


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
        clip_results, detections = _clips(options, jobs, folder, console)
    claims = evaluate_claims(results, detections)
    write_claims(claims, folder)
    paper_figures(results, folder)
    console.print(claim_table(claims))
    return clip_results


def _clips(
    options: Paper, jobs: "Sequence[ClipJob]", folder: Path, console: Console
) -> "tuple[list[ClipResult], list[ClipDetection]]":
    """Process the clips with every configuration, print and write the tables, traces and figures.

    Returns:
        All results, and the detections of the paper's setting.
    """
    from lgmd_gym.cli import clips
    from lgmd_gym.clips import study
    from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
    from lgmd_gym.clips.tables import config_table, detection_table
    from lgmd_gym.paper.plots import clip_figures

    folders = clips.make_clip_folders(folder, jobs)
    results = {
        name: clips.process_clips(
            jobs, folders, name, config, f"-{name}", figure=name == study.HEADLINE
        )
        for name, config in PLAYBACK_CONFIGS.items()
    }  # fmt: skip
    traces = study.traces_of(jobs, results)
    if options.crashes is None:
        crashes = study.published_crashes([job.name for job in jobs])
    else:
        crashes = [study.Crash(job.name, job.crash_s) for job in jobs if job.annotated]
    descriptions = {name: config.describe() for name, config in PLAYBACK_CONFIGS.items()}
    for title, group in study.groups_of(crashes).items():
        console.print(config_table(study.detections_of(traces, group), descriptions, title))
    detections = study.detections_of(traces, crashes)[study.HEADLINE]
    console.print(detection_table(f"{study.HEADLINE}: {descriptions[study.HEADLINE]}", detections))
    study.write_traces(folder / "clip_traces.csv", traces)
    (folder / "clips.md").write_text(study.results_text(traces, crashes), encoding="utf-8")
    clip_figures(traces, crashes, folder)
    return [result for items in results.values() for result in items], detections
