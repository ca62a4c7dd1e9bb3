"""Watched clips as tables on the terminal."""

from collections.abc import Mapping, Sequence

from rich.box import SIMPLE_HEAD
from rich.table import Table

from lgmd_gym.benchmark.summary import Rate
from lgmd_gym.video.clips.batch import Watched
from lgmd_gym.video.clips.detection import Chance, Detection, judge

DETECTION_NOTE = (
    "onset: an alarm after 1/3 s of quiet, in the 1.5 s before the crash (45 frames at 30 Hz). Earlier "
    "frames: those ahead of that window, without the first 8/30 s; of a clip without a crash, all. "
    "Chance: probability of an onset in any 1.5 s, from the onsets among the earlier frames [95 % "
    "interval]; few of them say little. p: of so many hits, each by the highest chance in the interval of "
    "all clips."
)
CHOICE_NOTE = (
    "hits: crashes with an onset in the 1.5 s before. Chance: of an onset in any 1.5 s, from the earlier "
    "frames of all clips. p: of so many hits, each by the highest chance in the interval. Choices ranked "
    "on the clips they are shown on look better than they are."
)
DETECTION_HEADS = (
    "crash\ns", "onset before\nthe crash", "lead\ns", "earlier frames\nin alarm", "onsets in\nearlier s",
    "chance of\nan onset", "peak\nspikes/s",
)  # fmt: skip


def clip_table(watched: Sequence[Watched]) -> Table:
    """Return one line per clip: how long, how loud, how fast it was watched."""
    table = Table(box=SIMPLE_HEAD)
    table.add_column("clip", overflow="fold")
    for name in (
        "frames",
        "peak\nspikes/s",
        "first\nalarm s",
        "onsets",
        "in alarm\n%",
        "dropped",
        "× real\ntime",
    ):
        table.add_column(name, justify="right")
    for item in watched:
        s = item.summary
        table.add_row(
            item.clip.name,
            str(s.frames),
            f"{s.peak:.0f}",
            "–" if s.first_alarm is None else f"{s.first_alarm:.2f}",
            str(s.onsets),
            f"{100.0 * s.alarms / max(s.frames, 1):.0f}",
            str(item.dropped) if item.dropped else "–",
            f"{s.frames / s.fps / item.seconds:.0f}",
        )
    return table


def detection_table(title: str, detections: Sequence[Detection]) -> Table:
    """Return one line per clip, and one for all: was there an onset before the crash, or was it chance?"""
    table = Table(title=title, caption=DETECTION_NOTE, box=SIMPLE_HEAD, caption_justify="left")
    table.add_column("clip", overflow="fold")
    for name in DETECTION_HEADS:
        table.add_column(name, justify="right")
    for item in detections:
        crash = item.crash_s is not None
        table.add_row(
            item.clip,
            f"{item.crash_s:.2f}" if item.crash_s is not None else "none",
            ("yes" if item.lead_s is not None else "no") if crash else "–",
            f"{item.lead_s:.2f}" if item.lead_s is not None else "–",
            _share(item.alarm_frames),
            f"{item.chance.onsets} in {item.chance.seconds:.1f}",
            _chance(item.chance),
            f"{item.peak:.0f}",
        )
    v = judge(detections)
    lead = f"{v.lead_s:.2f}" if v.hits.k else "–"
    earlier = f"{v.pooled.onsets} in {v.pooled.seconds:.1f}"
    hits, alarm = f"{v.hits.k} of {v.hits.n}", _share(v.alarm_frames)
    table.add_section()
    table.add_row("all", "", hits, lead, alarm, earlier, _chance(v.pooled), f"p = {v.p_value:.1g}")
    return table


def choice_table(by_choice: Mapping[str, Sequence[Detection]], described: Mapping[str, str]) -> Table:
    """Return one line per choice over all clips."""
    table = Table(
        title="choices over all clips", caption=CHOICE_NOTE, box=SIMPLE_HEAD, caption_justify="left"
    )
    table.add_column("choice", overflow="fold")
    table.add_column("alarm", overflow="fold")
    for name in ("hits", "chance", "p", "lead\ns", "earlier in\nalarm %", "quiet clips\nquiet"):
        table.add_column(name, justify="right")
    for name, detections in by_choice.items():
        v = judge(detections)
        table.add_row(
            name,
            described[name],
            f"{v.hits.k}/{v.hits.n}",
            _chance(v.pooled),
            f"{v.p_value:.1g}",
            f"{v.lead_s:.2f}" if v.hits.k else "–",
            f"{100.0 * v.alarm_frames.k / max(v.alarm_frames.n, 1):.0f}",
            f"{v.quiet_clips.k}/{v.quiet_clips.n}",
        )
    return table


def _share(rate: Rate) -> str:
    """A share in percent, with what it is a share of."""
    return "–" if rate.n == 0 else f"{rate.k}/{rate.n} = {100.0 * rate.k / rate.n:.0f} %"


def _chance(chance: Chance) -> str:
    if chance.seconds <= 0.0:
        return "? [0–1]"
    return f"{chance.level:.2f} [{chance.low:.2f}–{chance.high:.2f}]"
