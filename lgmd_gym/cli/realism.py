"""`lgmd-gym paper --realism`: simulated drives against real clips."""

from collections.abc import Sequence
from itertools import count
from pathlib import Path

from lgmd_gym.camera.worlds import SPLIT_WORLDS
from lgmd_gym.cli import clips
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.paper import Paper
from lgmd_gym.clips.batch import ClipJob, make_jobs
from lgmd_gym.errors import check_whole, check_within
from lgmd_gym.paper.realism import DriveValues, clip_values, common_optics, compare, simulated_values
from lgmd_gym.paper.realism_drives import Drives, Optics, simulated_drives
from lgmd_gym.paper.realism_plots import realism_figure
from lgmd_gym.paper.realism_tables import comparison_tables, summary_line, write_comparisons


def run(options: Paper) -> int:
    """Compare simulated drives with clips, print the tables and return 0."""
    if options.clips is None or options.picture is not None:
        raise ValueError("--realism requires --clips FOLDER and does not use --picture")
    seeds = range(check_whole("seeds", options.seeds, 1))
    worlds = SPLIT_WORLDS["train"][: check_whole("worlds", options.worlds, 0, len(SPLIT_WORLDS["train"]))]
    check_within("clip_hfov_deg", options.clip_hfov_deg, 10.0, 160.0, "degrees")
    check_within("ignore_bottom", options.ignore_bottom, 0.0, 0.5)
    jobs = make_jobs([options.clips], options.crashes)
    clips.print_notes(jobs, options.crashes)
    optics = common_optics(jobs, options.clip_hfov_deg, options.ignore_bottom)
    out = clips.default_out(options.out, "realism")
    settings = {"clips": [job.clip for job in jobs], "optics": optics._asdict(), "seeds": len(seeds),
                "worlds": len(worlds)}  # fmt: skip
    with clips.run_folder(out, settings) as folder:
        drives = _all_values(jobs, optics, options.night, simulated_drives(worlds, seeds))
        _write(drives, folder)
    make_console().print(f"tables and figure: {out}", soft_wrap=True)
    return 0


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
