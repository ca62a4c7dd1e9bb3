"""The `video` command; the attribute docstrings of `Video` are its help texts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.text import Text
from tyro.conf import Positional, arg

from lgmd_gym.aliases import Values
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.values import Count, File, Name, Number, default_out, read_params

if TYPE_CHECKING:
    from lgmd_gym.clips.batch import ClipJob, ClipResult
    from lgmd_gym.clips.detection import ClipDetection
    from lgmd_gym.clips.playback import PlaybackConfig
    from lgmd_gym.clips.scores import ScoredClip


@dataclass(frozen=True, kw_only=True)
class Video:
    """Run the neuron on video clips: spike traces, figures, overlay videos, a detection table.

    For each clip the run folder contains trace.csv (one row per frame), trace.png and, with --overlay,
    overlay.mp4. With --events it contains scores.csv and clip_scores.csv.
    """

    clips: Annotated[Positional[tuple[str, ...]], arg(metavar="CLIP [CLIP ...]")]
    """Video files in any format that ffmpeg reads, or folders with video files."""
    recursive: bool = False
    """Process the video files in the folders below a folder, too."""
    configs: tuple[str, ...] = ("paper",)
    """Named configurations of the neuron, compared in one table if several: paper, conservative, paper-18hz,
    paper-18hz-30, t_sf-60, t_sp-0.78, literal, released, off-only, fixed-inhibition; or all."""
    crashes: File = None
    """CSV file with the columns clip,crash_frame (empty for no crash); prints the detection table."""
    crash_frame: Count = None
    """Crash frame of a single clip, 0-based; prints the detection table."""
    events: File = None
    """CSV file with the columns file,event_s (seconds; empty for no event), optionally start_s,end_s; prints
    recall and average precision 0.5, 1.0 and 1.5 s before the event, and the time to accident."""
    false_alarm_cap: float = 0.1
    """With --events: highest share of 1.5 s windows in alarm in clips without an event."""
    out: File = None
    """Run folder; must not exist. Default: runs/video-DATE-TIME."""
    params: File = None
    """TOML file of LGMD parameters; replaces those of the configuration."""
    neuron: Name = None
    """Neuron model, registered or MODULE:FACTORY. Default: lgmd."""
    threshold: Number = None
    """Alarm level T_sf [spikes/s]; it applies to one frame rate."""
    fps: Number = None
    """Frame rate to resample to [Hz]; the neuron's response depends on it. Default: the clip's."""
    drop_duplicates: Number = None
    """Skip frames whose difference is below this fraction of the typical difference, for example 0.25; 0
    disables the filter. Default: from the configuration."""
    size: Annotated[tuple[int, int] | None, arg(metavar="WIDTH HEIGHT")] = None
    """Size to scale to [px]. Default: the clip's."""
    roi: Annotated[
        tuple[int, int, int, int] | None,
        arg(metavar="TOP LEFT HEIGHT WIDTH"),
    ] = None
    """Region of interest of the neuron [px]. Default: the whole frame."""
    overlay: bool = False
    """Write the overlay video: frame, excitation, spikes and alert indicator."""
    plots: bool = True
    """Draw one figure per clip."""


def run(options: Video) -> int:
    """Process clips and print tables; return 2 if a clip is truncated or unreadable, else 0."""
    from lgmd_gym.cli import clips
    from lgmd_gym.clips.batch import make_jobs
    from lgmd_gym.clips.playback import ClipRun
    from lgmd_gym.errors import check_within

    if not options.clips:
        raise ValueError("a clip is required: pass video files or folders, as in lgmd-gym video CLIP.mp4")
    configs = _configs(options)
    check_within("--false-alarm-cap", options.false_alarm_cap, 0.0, 1.0)
    unreadable: list[str] = []
    jobs = make_jobs(
        options.clips,
        options.crashes,
        options.crash_frame,
        options.events,
        on_unreadable=unreadable.append,
        recursive=options.recursive,
    )
    for text in unreadable:
        clips.note(f"{text}; it is left out")
    if options.events is not None and not any(job.event and job.event.event_s is not None for job in jobs):
        raise ValueError(f"{options.events} has no clip with an event; the scores need at least one event_s")
    clips.print_notes(jobs, options.crashes or options.events, options.fps)
    for job in jobs:  # decode the first frame of each clip before creating the folder
        next(iter(ClipRun(job.clip, next(iter(configs.values())))))
    out = default_out(options.out, "video")
    with clips.run_folder(out, {"clips": [job.clip for job in jobs], "configs": configs}) as folder:
        results = _process_all(options, jobs, configs, folder)
    make_console().print(f"traces and figures: {out}", soft_wrap=True)
    return clips.print_errors(results) or (2 if unreadable else 0)


def _process_all(
    options: Video, jobs: "Sequence[ClipJob]", configs: "dict[str, PlaybackConfig]", folder: Path
) -> "list[ClipResult]":
    """Process the clips with every configuration, print the tables and return all results."""
    from lgmd_gym.cli import clips
    from lgmd_gym.clips import tables
    from lgmd_gym.clips.scores import anticipation
    from lgmd_gym.clips.tables import score_table, write_clip_scores, write_scores

    folders = clips.make_clip_folders(folder, jobs)
    console = make_console()
    results: list[ClipResult] = []
    detections: dict[str, list[ClipDetection]] = {}
    scored: dict[str, list[ScoredClip]] = {}
    for name, config in configs.items():
        suffix = f"-{name}" if len(configs) > 1 else ""
        batch = clips.process_clips(
            jobs, folders, name, config, suffix, overlay=options.overlay, figure=options.plots
        )
        results += batch
        rates = sorted({result.summary.fps for result in batch})
        description = ", ".join(config.describe(rate) for rate in rates[:3])
        console.print(Text.assemble((name, "bold"), f": {description}"), highlight=False)
        console.print(tables.clip_table(batch))
        detections[name] = clips.detect_clips(jobs, batch)
        if detections[name]:
            console.print(tables.detection_table(f"{name}: {description}", detections[name]))
        scored[name] = clips.score_clips(jobs, batch)
    if len(configs) > 1 and all(detections.values()):
        descriptions = {name: config.describe() for name, config in configs.items()}
        console.print(tables.config_table(detections, descriptions))
    if options.events is not None:
        scores = {name: anticipation(items, options.false_alarm_cap) for name, items in scored.items()}
        for name, result in scores.items():
            console.print(score_table(name, result))
        write_scores(folder / "scores.csv", scores)
        write_clip_scores(folder / "clip_scores.csv", scored, scores)
    return results


def _configs(options: Video) -> "dict[str, PlaybackConfig]":
    """Return the named configurations with the values of the other options."""
    from lgmd_gym.clips.playback import PLAYBACK_CONFIGS, named_config
    from lgmd_gym.neuron import LGMDParams

    names = tuple(PLAYBACK_CONFIGS) if options.configs == ("all",) else dict.fromkeys(options.configs)
    values: Values = {
        name: getattr(options, name) for name in ("neuron", "fps", "size", "drop_duplicates", "roi")
    }
    params = read_params(options.params)
    if params is not None:
        values["params"] = LGMDParams.make(params)
    given = {name: value for name, value in values.items() if value is not None}
    configs = {name: replace(named_config(name), **given) for name in names}
    if options.threshold is not None:
        for name, config in configs.items():
            configs[name] = replace(config, params=replace(config.params, t_sf=options.threshold))
    return configs
