"""The terminal table and the CSV files of the scores of anticipation."""

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rich.table import Table

from lgmd_gym.clips.alarm_curves import FIGURES, HORIZONS_S, TTA_CAP, window_score
from lgmd_gym.clips.anticipation import CHANCE_DRAWS, Anticipation, Score
from lgmd_gym.clips.scored_clip import ScoredClip
from lgmd_gym.errors import counted

CAPTION = (
    "threshold: the lowest at which at most the cap of all 1.5 s windows in clips without an event is in "
    "alarm. recall: events whose 1.5 s up to 0.5, 1.0 or 1.5 s before them have an alarm at the threshold. "
    "AP: average precision of these windows against those of clips without an event. TTA: time from the "
    "first alarm to the event [s], of the events with an alarm; mTTA: its mean over all recalls. Chance: "
    "events at random times of clips without an event; p: probability of at least this value by chance."
)
SCORE_COLUMNS = (
    "configuration", "figure", "value", "low", "high", "clips", "chance", "p", "threshold", "cap"
)  # fmt: skip
_TIMES = FIGURES[FIGURES.index(TTA_CAP) :]


def score_table(title: str, result: Anticipation) -> Table:
    """Return one row per figure with its interval, number of clips and chance level."""
    table = Table(title=f"{title}: {_description(result)}", caption=CAPTION, caption_justify="left")
    table.add_column("figure")
    for name in ("value", "95 % interval", "clips", "chance", "p"):
        table.add_column(name, justify="right")
    for score in result.scores:
        interval = "–" if score.low is None else f"{_number(score, score.low)} – {_number(score, score.high)}"
        table.add_row(
            score.name, _number(score, score.value), interval, str(score.n),
            _number(score, score.chance), _p_value(score.p_value),
        )  # fmt: skip
    return table


def write_scores(path: Path, results: Mapping[str, Anticipation]) -> None:
    """Write one row per configuration and figure to a CSV file; times are in seconds, undefined is empty."""
    rows = [
        (name, score.name, score.value, score.low, score.high, score.n, score.chance, score.p_value,
         _finite(result.threshold), result.cap)
        for name, result in results.items() for score in result.scores
    ]  # fmt: skip
    _write(path, SCORE_COLUMNS, rows)


def write_clip_scores(
    path: Path, clips: Mapping[str, Sequence[ScoredClip]], results: Mapping[str, Anticipation]
) -> None:
    """Write one row per configuration and clip: the highest scores, and the time to accident at the cap."""
    columns = ("configuration", "clip", "event", "evaluated_s", "highest_score",
               *(f"score_at_{tau:.1f}_s" for tau in HORIZONS_S), "tta_at_cap_s")  # fmt: skip
    rows = []
    for name, items in clips.items():
        threshold = results[name].threshold
        for clip in items:
            at = [window_score(clip.scores, clip.fps, tau) if clip.event else None for tau in HORIZONS_S]
            highest = float(clip.scores.max()) if len(clip.scores) else None
            rows.append((name, clip.name, int(clip.event), len(clip.scores) / clip.fps, highest, *at,
                         clip.time_to_event(threshold)))  # fmt: skip
    _write(path, columns, rows)


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
