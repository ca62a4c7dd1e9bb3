"""Tables of processed clips for the terminal, and CSV files of their scores."""

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rich.table import Table

from lgmd_gym.clips.batch import ClipResult
from lgmd_gym.clips.detection import ChanceLevel, ClipDetection, DetectionSummary, summarize_detections
from lgmd_gym.clips.scores import (
    CHANCE_DRAWS,
    FIGURES,
    HORIZONS_S,
    TTA_CAP,
    Anticipation,
    Score,
    ScoredClip,
    window_score,
)
from lgmd_gym.errors import counted

DETECTION_CAPTION = (
    "onset: an alarm after 1/3 s without alarm, in the 1.5 s before the crash (45 frames at 30 Hz). Earlier "
    "frames: those before that window, without the first 8/30 s; in a clip without a crash, all frames. "
    "Chance: probability of an onset in any 1.5 s, from the onsets in the earlier frames [95 % interval]; "
    "few frames give a wide interval. p: probability of at least as many hits, each at the upper bound of "
    "the chance over all clips."
)
CONFIG_CAPTION = (
    "hits: crashes with an onset in the 1.5 s before. Chance: probability of an onset in any 1.5 s, from the "
    "earlier frames of all clips. p: probability of at least as many hits, each at the upper bound of the "
    "chance, times the number of configurations (Bonferroni). A ranking on the same clips that the "
    "configurations were selected on is optimistic."
)
CLIP_COLUMNS = (
    "frames",
    "peak\nspikes/s",
    "first\nalarm s",
    "onsets",
    "in alarm\n%",
    "dupli-\ncates",
    "× real\ntime",
)
DETECTION_COLUMNS = (
    "crash\ns",
    "onset before\nthe crash",
    "lead\ns",
    "earlier frames\nin alarm",
    "onsets in\nearlier s",
    "chance of\nan onset",
    "peak\nspikes/s",
)
CONFIG_COLUMNS = ("hits", "chance", "p", "lead\ns", "earlier in\nalarm %", "clips without\ncrash or alarm")


def clip_table(results: Sequence[ClipResult]) -> Table:
    """Return one row per clip: length, alarms and processing speed."""
    table = _table(("clip",), CLIP_COLUMNS)
    for item in results:
        s = item.summary
        first = "–" if s.first_alarm is None else f"{s.first_alarm:.2f}"
        alarm, speed = 100.0 * s.alarms / max(s.frames, 1), s.frames / s.fps / item.seconds
        table.add_row(
            item.clip.name,
            str(s.frames),
            f"{s.peak:.0f}",
            first,
            str(s.onsets),
            f"{alarm:.0f}",
            str(item.duplicates or "–"),
            f"{speed:.0f}",
        )
    return table


def detection_table(title: str, detections: Sequence[ClipDetection]) -> Table:
    """Return one row per clip and one for all: onset before the crash, and its probability by chance."""
    table = _table(("clip",), DETECTION_COLUMNS, title, DETECTION_CAPTION)
    *rows, total = detection_rows(detections)
    for row in rows:
        table.add_row(*row)
    table.add_section()
    table.add_row(*total)
    return table


def detection_rows(detections: Sequence[ClipDetection]) -> list[tuple[str, ...]]:
    """Return the cells of one row per clip and one for all: the clip, then `DETECTION_COLUMNS`."""
    rows: list[tuple[str, ...]] = []
    for item in detections:
        hit = "–" if item.crash_s is None else "no" if item.lead_s is None else "yes"
        times = _seconds(item.crash_s, "none"), hit, _seconds(item.lead_s)
        rows.append((item.clip, *times, *_chance_cells(item), f"{item.peak:.0f}"))
    total = summarize_detections(detections)
    hits = "", f"{total.hits.k} of {total.hits.n}", _seconds(total.lead_s)
    return [*rows, ("all", *hits, *_chance_cells(total), f"p = {total.p_value:.1g}")]


def config_row(total: DetectionSummary, tests: int) -> list[str]:
    """Return the cells of `CONFIG_COLUMNS` for one configuration.

    Args:
        total: Its detections.
        tests: Number of configurations, by which p is multiplied.
    """
    alarm = 100.0 * total.alarm_frames.k / max(total.alarm_frames.n, 1)
    return [
        f"{total.hits.k}/{total.hits.n}",
        _interval(total.chance),
        f"{min(total.p_value * tests, 1.0):.1g}",
        _seconds(total.lead_s),
        f"{alarm:.0f}",
        f"{total.silent_clips.k}/{total.silent_clips.n}",
    ]


def config_table(
    detections: Mapping[str, Sequence[ClipDetection]],
    descriptions: Mapping[str, str],
    title: str = "configurations over all clips",
) -> Table:
    """Return one row per configuration over all clips."""
    table = _table(("configuration", "alarm"), CONFIG_COLUMNS, title, CONFIG_CAPTION)
    for name, items in detections.items():
        row = config_row(summarize_detections(items), len(detections))
        table.add_row(name, descriptions[name], *row)
    return table


def _table(
    text: Sequence[str], numbers: Sequence[str], title: str | None = None, note: str | None = None
) -> Table:
    """Return an empty table with columns of text on the left and of numbers on the right."""
    table = Table(title=title, caption=note, caption_justify="left")
    for name in text:
        table.add_column(name, overflow="fold")
    for name in numbers:
        table.add_column(name, justify="right")
    return table


def _seconds(value: float | None, missing: str = "–") -> str:
    return missing if value is None or math.isnan(value) else f"{value:.2f}"


def _chance_cells(item: ClipDetection | DetectionSummary) -> tuple[str, str, str]:
    """Return the share of alarm frames, the onsets and the chance level of the earlier part."""
    rate, chance = item.alarm_frames, item.chance
    share = "–" if rate.n == 0 else f"{rate.k}/{rate.n} = {100.0 * rate.k / rate.n:.0f} %"
    return share, f"{chance.onsets} in {chance.seconds:.1f}", _interval(chance)


def _interval(chance: ChanceLevel) -> str:
    if chance.seconds <= 0.0:
        return "? [0–1]"
    return f"{chance.probability:.2f} [{chance.low:.2f}–{chance.high:.2f}]"


CAPTION = (
    "threshold: the lowest at which at most the cap of all 1.5 s windows in clips without an event is in "
    "alarm. recall: events whose 1.5 s up to 0.5, 1.0 or 1.5 s before them have an alarm at the threshold. "
    "AP: average precision of these windows against those of clips without an event. TTA: time from the "
    "first alarm to the event [s], of the events with an alarm; mTTA: its mean over all recalls. Chance: "
    "events at random times of clips without an event; p: probability of at least this value by chance."
)
SCORE_COLUMNS = [
    "configuration",
    "figure",
    "value",
    "low",
    "high",
    "clips",
    "chance",
    "p",
    "threshold",
    "cap",
]
_TIMES = FIGURES[FIGURES.index(TTA_CAP) :]


def score_table(title: str, result: Anticipation) -> Table:
    """Return one row per figure with its interval, number of clips and chance level."""
    columns = ("value", "95 % interval", "clips", "chance", "p")
    table = _table(("figure",), columns, f"{title}: {_description(result)}", CAPTION)
    for score in result.scores:
        interval = "–" if score.low is None else f"{_number(score, score.low)} – {_number(score, score.high)}"
        table.add_row(
            score.name,
            _number(score, score.value),
            interval,
            str(score.n),
            _number(score, score.chance),
            _p_value(score.p_value),
        )
    return table


def write_scores(path: Path, results: Mapping[str, Anticipation]) -> None:
    """Write one row per configuration and figure to a CSV file; times are in seconds, undefined is empty."""
    rows = [
        (name, *score, _finite(result.threshold), result.cap)
        for name, result in results.items()
        for score in result.scores
    ]
    _write(path, SCORE_COLUMNS, rows)


def write_clip_scores(
    path: Path, clips: Mapping[str, Sequence[ScoredClip]], results: Mapping[str, Anticipation]
) -> None:
    """Write one row per configuration and clip: the highest scores, and the time to accident at the cap."""
    score_columns = [f"score_at_{tau:.1f}_s" for tau in HORIZONS_S]
    head = ("configuration", "clip", "event", "evaluated_s", "highest_score")
    rows: list[Sequence[object]] = []
    for name, items in clips.items():
        threshold = results[name].threshold
        for clip in items:
            at = [window_score(clip.scores, clip.fps, tau) if clip.event else None for tau in HORIZONS_S]
            highest = float(clip.scores.max()) if len(clip.scores) else None
            evaluated = len(clip.scores) / clip.fps
            row = (name, clip.name, int(clip.event), evaluated, highest, *at, clip.time_to_event(threshold))
            rows.append(row)
    _write(path, [*head, *score_columns, "tta_at_cap_s"], rows)


def _description(result: Anticipation) -> str:
    """Return the numbers of clips and the threshold."""
    clips = f"{counted(result.events, 'clip')} with and {result.negatives} without an event"
    if result.threshold is None:
        return f"{clips}; false alarms, recall and AP need clips without an event"
    cap = f"at most {100.0 * result.cap:g} % false alarms"
    if math.isinf(result.threshold):
        return f"{clips}; no threshold has {cap}"
    return f"{clips}, threshold {result.threshold:g} spikes/s for {cap}"


def _number(score: Score, value: float | None) -> str:
    return "–" if value is None else f"{value:.2f} s" if score.name in _TIMES else f"{value:.2f}"


def _p_value(value: float | None) -> str:
    least = 1.0 / CHANCE_DRAWS
    return "–" if value is None else f"< {least:g}" if value < least else f"{value:.2g}"


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _write(path: Path, columns: Iterable[str], rows: Iterable[Sequence[object]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in rows)
