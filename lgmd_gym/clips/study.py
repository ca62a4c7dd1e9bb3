"""Detection on annotated clips by every configuration: compact traces, exact tests and tables in Markdown."""

import csv
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lgmd_gym.clips.batch import ClipJob, ClipResult, read_trace
from lgmd_gym.clips.detection import ClipDetection, DetectionSummary, detect, summarize_detections
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
from lgmd_gym.clips.published import FILE_FPS, NEW, USED, published_clips
from lgmd_gym.clips.tables import CONFIG_COLUMNS, DETECTION_COLUMNS, config_row, detection_rows
from lgmd_gym.errors import counted

HEADLINE = "paper-18hz"  # the setting of the paper: 18 Hz, T_sf from 15 spikes/s on
ORDER = (HEADLINE, "paper-18hz-30", *PLAYBACK_CONFIGS)  # of the rows of a table
TRACE_FIELDS = ("configuration", "clip", "fps", "spike_frequency", "membrane_potential")


class ClipTrace(NamedTuple):
    """Response of one configuration to one clip."""

    configuration: str  # name in `PLAYBACK_CONFIGS`
    clip: str  # name of the clip
    fps: float  # frame rate of the run [Hz]
    spike_frequency: np.ndarray  # of each frame [spikes/s], shape (frames,)
    membrane_potential: np.ndarray  # K of each frame, shape (frames,); of shape (0,) but for `HEADLINE`

    @property
    def alarm(self) -> np.ndarray:
        """Alarm state of each frame: whether the spike frequency reaches T_sf of the configuration."""
        return self.spike_frequency >= PLAYBACK_CONFIGS[self.configuration].params.t_sf


class Crash(NamedTuple):
    """Annotation of a clip as times."""

    clip: str  # name of the clip
    crash_s: float | None  # time of the crash [s]; None without one
    tolerance_s: float = 0.0  # uncertainty of that time [s]
    group: str = ""  # `USED`, `NEW`, or empty for clips of the user


def published_crashes(names: Collection[str]) -> list[Crash]:
    """Return the annotation of those published clips whose names are given."""
    return [
        Crash(clip.name, clip.crash_s, clip.tolerance_frames / FILE_FPS, clip.group)
        for clip in published_clips()
        if clip.name in names
    ]


def traces_of(jobs: Sequence[ClipJob], results: Mapping[str, Sequence[ClipResult]]) -> list[ClipTrace]:
    """Return the compact traces of processed clips.

    Args:
        jobs: The clips.
        results: Results of each configuration, in the order of the jobs.
    """
    traces: list[ClipTrace] = []
    for name, items in results.items():
        for job, result in zip(jobs, items, strict=True):
            table = read_trace(result, "spike_frequency", "membrane_potential")
            potential = table[:, 1] if name == HEADLINE else np.zeros(0)
            traces.append(ClipTrace(name, job.name, result.summary.fps, table[:, 0], potential))
    return traces


def write_traces(path: Path, traces: Iterable[ClipTrace]) -> None:
    """Write one row per configuration and clip to a CSV file; spaces separate the values of the frames."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(TRACE_FIELDS)
        for trace in traces:
            frequency = " ".join(f"{value:.6g}" for value in trace.spike_frequency)
            potential = " ".join(f"{value:.3f}" for value in trace.membrane_potential)
            writer.writerow((trace.configuration, trace.clip, f"{trace.fps:g}", frequency, potential))


def read_traces(path: Path) -> list[ClipTrace]:
    """Return the traces in a file of `write_traces`.

    Raises:
        ValueError: If the file cannot be read or has other contents.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            return [
                ClipTrace(
                    row["configuration"],
                    row["clip"],
                    float(row["fps"]),
                    *(np.array(row[name].split(), float) for name in TRACE_FIELDS[3:]),
                )
                for row in csv.DictReader(file)
            ]
    except OSError as error:
        raise ValueError(f"traces {str(path)!r} cannot be read: {error.strerror}") from None
    except (KeyError, TypeError, ValueError, AttributeError):
        raise ValueError(f"{str(path)!r} does not have the columns {','.join(TRACE_FIELDS)}") from None


def detections_of(
    traces: Iterable[ClipTrace], crashes: Iterable[Crash], shift: int = 0
) -> dict[str, list[ClipDetection]]:
    """Return the detections of each configuration, in `ORDER` and in the order of the crashes.

    Args:
        traces: The traces; those of other clips are left out.
        crashes: Annotation of the clips; those without a trace are left out.
        shift: Number of tolerances by which each crash is later.
    """
    by_key = {(trace.configuration, trace.clip): trace for trace in traces}
    crashes = list(crashes)
    found: dict[str, list[ClipDetection]] = {}
    for name in dict.fromkeys(ORDER):
        items = [(crash, by_key[name, crash.clip]) for crash in crashes if (name, crash.clip) in by_key]
        if items:
            found[name] = [
                detect(trace.clip, trace.spike_frequency, trace.alarm, trace.fps, _moved(crash, shift, trace))
                for crash, trace in items
            ]
    return found


def _moved(crash: Crash, shift: int, trace: ClipTrace) -> float | None:
    """Return the time of a crash, moved by a number of tolerances within the clip [s]."""
    if crash.crash_s is None:
        return None
    return min(crash.crash_s + shift * crash.tolerance_s, len(trace.spike_frequency) / trace.fps)


def groups_of(crashes: Sequence[Crash]) -> dict[str, list[Crash]]:
    """Return the clips of each group with its title; all of them if there are several groups."""
    groups: dict[str, list[Crash]] = {}
    for name in dict.fromkeys(crash.group for crash in crashes):
        items = [crash for crash in crashes if crash.group == name]
        noun, rest = (
            ("new clip", "") if name == NEW else ("clip", " used for earlier choices" * (name == USED))
        )
        groups[counted(len(items), noun) + rest] = items
    return groups | ({f"all {len(crashes)} clips": list(crashes)} if len(groups) > 1 else {})


def results_text(traces: Sequence[ClipTrace], crashes: Sequence[Crash]) -> str:
    """Return the tables of all groups, and of the single clips at the paper's setting, in Markdown."""
    parts: list[str] = []
    for title, group in groups_of(crashes).items():
        detections, moved = detections_of(traces, group), [detections_of(traces, group, k) for k in (-1, 1)]
        totals = {name: summarize_detections(items) for name, items in detections.items()}
        rows = [
            _row(name, total, [summarize_detections(side[name]) for side in moved], len(totals))
            for name, total in totals.items()
        ]
        crashed = sum(crash.crash_s is not None for crash in group)
        without = len(group) - crashed
        parts.append(f"### {title[0].upper()}{title[1:]}: {crashed} with a crash, {without} without")
        columns = ["configuration", "alarm", *_flat(CONFIG_COLUMNS)]
        columns.insert(3, "hits, crash earlier / later")
        parts.append(markdown_table(columns, rows))
    for name in ORDER[:2]:
        detections = detections_of(traces, crashes).get(name)
        if detections:
            parts.append(f"### Single clips: {PLAYBACK_CONFIGS[name].describe()}")
            parts.append(markdown_table(["clip", *_flat(DETECTION_COLUMNS)], detection_rows(detections)))
    return "\n\n".join(parts) + "\n"


def _flat(columns: Iterable[str]) -> list[str]:
    """Return names of columns in one line each."""
    return [column.replace("\n", " ") for column in columns]


def _row(name: str, total: DetectionSummary, moved: Sequence[DetectionSummary], tests: int) -> list[str]:
    """Return one row of the table of configurations."""
    hits, *rest = config_row(total, tests)
    sides = " / ".join(str(side.hits.k) for side in moved)
    return [f"`{name}`", PLAYBACK_CONFIGS[name].describe(), hits, sides, *rest]


def markdown_table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
