"""Simulated drives against real clips: tables and a figure of twelve statistics.

python docs/experiments/realism/realism.py --clips FOLDER [--crashes crashes.csv] --out RUN
"""

import argparse
import sys
from collections.abc import Sequence
from itertools import count
from pathlib import Path

from comparison import DriveValues, clip_values, common_optics, compare, simulated_values
from drives import Drives, Optics, simulated_drives
from report import comparison_tables, realism_figure, summary_line, write_comparisons

from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.cli import clips
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import default_out
from lgmd_gym.clips.batch import ClipJob, make_jobs
from lgmd_gym.clips.published import NEW, USED, find_published, published_clips
from lgmd_gym.errors import check_whole, check_within


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare simulated drives with clips, print the tables and write them with the figure."""
    options = parse(arguments)
    seeds = range(check_whole("seeds", options.seeds, 1))
    worlds = SPLIT_WORLDS["train"][: check_whole("worlds", options.worlds, 0, len(SPLIT_WORLDS["train"]))]
    check_within("clip_hfov_deg", options.clip_hfov_deg, 10.0, 160.0, "degrees")
    check_within("ignore_bottom", options.ignore_bottom, 0.0, 0.5)
    jobs = _jobs(options.clips, options.crashes, options.group)
    optics = common_optics(jobs, options.clip_hfov_deg, options.ignore_bottom)
    out = default_out(options.out, "realism")
    settings = {
        "clips": [job.clip for job in jobs],
        "optics": optics._asdict(),
        "seeds": len(seeds),
        "worlds": len(worlds),
    }
    with clips.run_folder(out, settings) as folder:
        drives = _all_values(jobs, optics, options.night, simulated_drives(worlds, seeds))
        _write(drives, folder)
    make_console().print(f"tables and figure: {out}", soft_wrap=True)


def _jobs(folder: Path, crashes: Path | None, group: str | None) -> list[ClipJob]:
    """Return the clips of a folder, or those of a group of the published clips in it."""
    if group is None:
        jobs = make_jobs([folder], crashes)
        clips.print_notes(jobs, crashes)
        return jobs
    if crashes is not None:
        raise ValueError("--group uses the annotation of the package; remove --crashes")
    names = {clip.name for clip in published_clips() if clip.group == group}
    jobs = [job for job in find_published(folder).jobs if job.name in names]
    if len(jobs) < len(names):
        raise ValueError(f"{str(folder)!r} has {len(jobs)} of the {len(names)} clips of the group {group!r}")
    return jobs


def parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clips", type=Path, required=True, help="folder of driving clips")
    parser.add_argument("--crashes", type=Path, help="CSV file with the columns clip,crash_frame")
    parser.add_argument(
        "--group",
        choices=(USED, NEW),
        help="published clips of the folder, by SHA-256, with the annotation of the package",
    )
    parser.add_argument("--out", type=Path, help="folder to write; default: runs/realism-DATE-TIME")
    parser.add_argument(
        "--clip-hfov-deg",
        type=float,
        default=90.0,
        help="horizontal field of view of the clips; 90 has the pixels per degree of a dash camera of 120 to "
        "140 degrees on the diagonal in the centre of the frame",
    )
    parser.add_argument(
        "--ignore-bottom",
        type=float,
        default=0.0,
        help="share of the height, at the bottom, that is left out: bonnets and captions",
    )
    parser.add_argument(
        "--night", nargs="+", help="clips at night; default: those with a median grey below 75"
    )
    parser.add_argument("--seeds", type=int, default=3, help="seeds of every simulated drive")
    parser.add_argument("--worlds", type=int, default=20, help="number of worlds; 0 for the laboratory")
    return parser.parse_args(arguments)


def _all_values(
    jobs: Sequence[ClipJob], optics: Optics, night: Sequence[str] | None, drives: Sequence[Drives]
) -> list[DriveValues]:
    """Return the statistics of the clips, and of the simulated drives of their groups."""
    steps = count(1)
    with clips.progress_bar("clips", len(jobs)) as set_progress:
        real = clip_values(jobs, optics, night, lambda: set_progress(next(steps)))
    groups = {item.group for item in real}
    compared, steps = [item for item in drives if item.group in groups], count(1)
    with clips.progress_bar("simulated drives", sum(len(item.seeds) for item in compared)) as set_progress:
        return real + simulated_values(compared, optics, lambda: set_progress(next(steps)))


def _write(drives: Sequence[DriveValues], folder: Path) -> None:
    comparisons, console = compare(drives), make_console()
    write_comparisons(comparisons, drives, folder)
    realism_figure(comparisons, folder / "realism.png")
    for table in comparison_tables(comparisons):
        console.print(table)
    console.print(summary_line(comparisons))


if __name__ == "__main__":
    try:
        main()
    except ValueError as error:
        sys.exit(f"realism.py: {error}")
