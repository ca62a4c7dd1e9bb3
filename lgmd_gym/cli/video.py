"""The `video` command."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from rich.text import Text

from lgmd_gym.cli import clips
from lgmd_gym.cli.console import make_console
from lgmd_gym.cli.options import Video
from lgmd_gym.cli.params import read_params
from lgmd_gym.clips import tables
from lgmd_gym.clips.anticipation import anticipation
from lgmd_gym.clips.batch import ClipJob, ClipResult, make_jobs
from lgmd_gym.clips.mcap_file import check_mcap
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS, ClipRun, PlaybackConfig, named_config
from lgmd_gym.clips.score_tables import score_table, write_clip_scores, write_scores
from lgmd_gym.clips.scored_clip import ScoredClip
from lgmd_gym.errors import check_within
from lgmd_gym.neuron import LGMDParams


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
    clips.print_notes(jobs, options.crashes or options.events, options.fps)
    for job in jobs:  # decode the first frame of each clip before creating the folder
        next(iter(ClipRun(job.clip, next(iter(configs.values())))))
    out = clips.default_out(options.out, "video")
    with clips.run_folder(out, {"clips": [job.clip for job in jobs], "configs": configs}) as folder:
        results = _process_all(options, jobs, configs, folder)
    make_console().print(f"traces and figures: {out}", soft_wrap=True)
    return clips.print_errors(results)


def _process_all(
    options: Video, jobs: Sequence[ClipJob], configs: dict[str, PlaybackConfig], folder: Path
) -> list[ClipResult]:
    """Process the clips with every configuration, print the tables and return all results."""
    folders = clips.make_clip_folders(folder, jobs)
    console, results, detections = make_console(), [], {}
    scored: dict[str, list[ScoredClip]] = {}
    for name, config in configs.items():
        suffix = f"-{name}" if len(configs) > 1 else ""
        batch = clips.process_clips(
            jobs, folders, name, config, suffix,
            overlay=options.overlay, mcap=options.mcap, figure=options.plots,
        )  # fmt: skip
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
