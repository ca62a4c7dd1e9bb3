"""Terminal tables of processed clips."""

import math
from collections.abc import Mapping, Sequence

from rich.table import Table

from lgmd_gym.clips.batch import ClipResult
from lgmd_gym.clips.detection import ChanceLevel, ClipDetection, DetectionSummary, summarize_detections

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
    "chance. A ranking on the same clips that the configurations were selected on is optimistic."
)
CLIP_COLUMNS = (
    "frames", "peak\nspikes/s", "first\nalarm s", "onsets", "in alarm\n%", "dupli-\ncates", "× real\ntime",
)  # fmt: skip
DETECTION_COLUMNS = (
    "crash\ns", "onset before\nthe crash", "lead\ns", "earlier frames\nin alarm", "onsets in\nearlier s",
    "chance of\nan onset", "peak\nspikes/s",
)  # fmt: skip
CONFIG_COLUMNS = ("hits", "chance", "p", "lead\ns", "earlier in\nalarm %", "clips without\ncrash or alarm")


def clip_table(results: Sequence[ClipResult]) -> Table:
    """Return one row per clip: length, alarms and processing speed."""
    table = _table(("clip",), CLIP_COLUMNS)
    for item in results:
        s = item.summary
        first = "–" if s.first_alarm is None else f"{s.first_alarm:.2f}"
        alarm, speed = 100.0 * s.alarms / max(s.frames, 1), s.frames / s.fps / item.seconds
        table.add_row(
            item.clip.name, str(s.frames), f"{s.peak:.0f}", first, str(s.onsets), f"{alarm:.0f}",
            str(item.duplicates or "–"), f"{speed:.0f}",
        )  # fmt: skip
    return table


def detection_table(title: str, detections: Sequence[ClipDetection]) -> Table:
    """Return one row per clip and one for all: onset before the crash, and its probability by chance."""
    table = _table(("clip",), DETECTION_COLUMNS, title, DETECTION_CAPTION)
    for item in detections:
        hit = "–" if item.crash_s is None else "no" if item.lead_s is None else "yes"
        table.add_row(
            item.clip, _seconds(item.crash_s, "none"), hit, _seconds(item.lead_s),
            *_chance_cells(item), f"{item.peak:.0f}",
        )  # fmt: skip
    total = summarize_detections(detections)
    hits, lead = f"{total.hits.k} of {total.hits.n}", _seconds(total.lead_s)
    table.add_section()
    table.add_row("all", "", hits, lead, *_chance_cells(total), f"p = {total.p_value:.1g}")
    return table


def config_table(detections: Mapping[str, Sequence[ClipDetection]], descriptions: Mapping[str, str]) -> Table:
    """Return one row per configuration over all clips.

    Args:
        detections: Detections of all clips by name of the configuration.
        descriptions: Description of each configuration.
    """
    table = _table(
        ("configuration", "alarm"), CONFIG_COLUMNS, "configurations over all clips", CONFIG_CAPTION
    )
    for name, items in detections.items():
        total = summarize_detections(items)
        alarm = 100.0 * total.alarm_frames.k / max(total.alarm_frames.n, 1)
        table.add_row(
            name, descriptions[name], f"{total.hits.k}/{total.hits.n}", _interval(total.chance),
            f"{total.p_value:.1g}", _seconds(total.lead_s), f"{alarm:.0f}",
            f"{total.silent_clips.k}/{total.silent_clips.n}",
        )  # fmt: skip
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
