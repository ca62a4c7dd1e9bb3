"""What `lgmd-gym video` and `lgmd-gym paper` do with their parsed options."""

import json
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from lgmd_gym.benchmark.folder import new_folder
from lgmd_gym.cli.console import make_console

if TYPE_CHECKING:
    from lgmd_gym.cli.options import Paper, Video
    from lgmd_gym.video.clips.batch import Order, Watched
    from lgmd_gym.video.clips.detection import Detection
    from lgmd_gym.video.clips.playback import Choice


def video(options: "Video") -> int:
    """Watch clips and report; 0 if all could be read to their ends, 2 if one breaks off."""
    from lgmd_gym.video.clips import tables as clips_tables
    from lgmd_gym.video.clips.batch import detection
    from lgmd_gym.video.clips.playback import Watch

    chosen = _choices(options)
    orders, judged = _orders(options)
    for order in orders:  # a first look at each: bad input leaves no folder behind
        next(iter(Watch(order.clip, next(iter(chosen.values())))))
    out = new_folder(options.out or Path("runs") / f"video-{time.strftime('%Y%m%d-%H%M%S')}", "run folder")
    orders = [order._replace(folder=_clip_folder(out, order.clip)) for order in orders]
    _describe(out, {"clips": [order.clip for order in orders], "choices": chosen})
    console, troubles, detections = make_console(120), [], {}
    for name, choice in chosen.items():
        suffix = f"-{name}" if len(chosen) > 1 else ""
        watched = _watch_all(orders, name, choice, suffix, options)
        troubles += [item.trouble for item in watched if item.trouble]
        fps = {item.clip: item.summary.fps for item in watched}
        rates = sorted(set(fps.values()))
        about = ", ".join(choice.describe(rate) for rate in rates[:3])
        console.print(f"[bold]{name}[/]: {about}", highlight=False)
        console.print(clips_tables.clip_table(watched))
        if judged:
            detections[name] = [
                detection(order, order.folder / f"trace{suffix}.csv", fps[order.clip])
                for order in orders
                if order.clip in judged
            ]
            console.print(clips_tables.detection_table(f"{name}: {about}", detections[name]))
    if len(detections) > 1:
        described = {name: choice.describe() for name, choice in chosen.items()}
        console.print(clips_tables.choice_table(detections, described))
    console.print(f"traces and figures: {out}", soft_wrap=True)
    for trouble in dict.fromkeys(troubles):
        print(f"lgmd-gym: {trouble}; the trace up to there is kept", file=sys.stderr)
    return 2 if troubles else 0


def _choices(options: "Video") -> "dict[str, Choice]":
    """Return the named choices with the options laid over each."""
    from lgmd_gym.cli.params import read_params
    from lgmd_gym.neuron import LGMDParams
    from lgmd_gym.video.clips.playback import CHOICES, changed, named_choice

    names = tuple(CHOICES) if options.choices == ("all",) else dict.fromkeys(options.choices)
    plain = read_params(options.params)
    params = None if plain is None else LGMDParams.from_dict(plain)
    over = {
        "params": params, "t_sf": options.threshold, "fps": options.fps, "size": options.size,
        "drop_duplicates": options.drop_duplicates, "roi": options.roi,
    }  # fmt: skip
    return {name: changed(named_choice(name), **over) for name in names}


def _orders(options: "Video") -> "tuple[list[Order], set[Path]]":
    """Return the clips to watch, all of which can be opened, and those whose crash is known or known not."""
    from lgmd_gym.video import find_clips
    from lgmd_gym.video.clips.annotations import read_crashes
    from lgmd_gym.video.clips.batch import Order
    from lgmd_gym.video.probe import probe

    if not options.clips:
        raise ValueError("which clip? Give video files, or folders of them: lgmd-gym video CLIP.mp4")
    clips = list(dict.fromkeys(find_clips(options.clips)))
    if options.crash_frame is not None and (len(clips) > 1 or options.crashes is not None):
        raise ValueError(
            f"--crash-frame {options.crash_frame} is for one clip; for several give --crashes FILE"
        )
    crashes: dict[Path, int | None] = {}
    if options.crashes is not None:
        crashes = read_crashes(options.crashes, clips)
    elif options.crash_frame is not None:
        crashes = {clips[0]: options.crash_frame}
    orders = []
    for clip in clips:
        info, crash = probe(clip), crashes.get(clip)
        if crash is not None and not 0 <= crash < info.frames:
            raise ValueError(
                f"crash frame {crash} of {clip.name} is not among its frames 0 to {info.frames - 1}"
            )
        if info.variable and options.fps is None:
            _note(f"{clip.name} has a variable frame rate; resampled to {info.fps:g} Hz")
        orders.append(Order(clip, info, crash, clip.parent))
    for clip in clips:
        if crashes and clip not in crashes:
            _note(f"{clip.name} has no row in {options.crashes}; left out of the detection table")
    return orders, set(crashes)


def _watch_all(
    orders: "list[Order]", name: str, choice: "Choice", suffix: str, options: "Video"
) -> "list[Watched]":
    """Watch every clip by one choice, with a progress bar."""
    from lgmd_gym.video.clips.batch import watch_clip

    total = sum(order.info.frames for order in orders)
    watched, before = [], 0
    with _progress(name, total) as move:
        for order in orders:

            def tick(now: int, expected: int, before: int = before, frames: int = order.info.frames) -> None:
                move(before + min(now / expected, 1.0) * frames)

            watched.append(watch_clip(order, choice, suffix, options.overlay, options.plots, tick))
            before += order.info.frames
        move(total)
    return watched


@contextmanager
def _progress(name: str, total: float) -> Iterator[Any]:
    """Show a progress bar on stderr and yield the function that sets it."""
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True)) as bar:
        shown = bar.add_task(name, total=total)
        yield lambda done: bar.update(shown, completed=done)


def _clip_folder(out: Path, clip: Path) -> Path:
    """Make the folder of one clip, numbered if another clip of that name came before."""
    folder, number = out / clip.stem, 1
    while folder.exists():
        number += 1
        folder = out / f"{clip.stem}-{number}"
    folder.mkdir()
    return folder


def _describe(out: Path, settings: dict[str, Any]) -> None:
    """Write `run.json`: the settings, and the machine and versions they ran on."""
    from lgmd_gym.benchmark.folder import provenance

    text = json.dumps(settings | provenance(), indent=2, default=str)
    (out / "run.json").write_text(text + "\n", encoding="utf-8")


def _note(text: str) -> None:
    """Say something once on stderr."""
    print(f"lgmd-gym: {text}", file=sys.stderr)


def paper(options: "Paper") -> int:
    """Run the paper's experiments, draw their figures and print what holds; 2 if a clip breaks off."""
    from lgmd_gym.paper import experiments
    from lgmd_gym.paper.claims import claim_table, verdicts, write_claims
    from lgmd_gym.paper.plots import paper_figures
    from lgmd_gym.paper.stimuli import Panorama, Screen

    if (options.clips is None) != (options.crashes is None):
        raise ValueError("--clips and --crashes go together: a folder, and a CSV with clip,crash_frame")
    Panorama(picture=options.picture).paint(0.0, Screen())  # a picture that cannot be read leaves no folder
    films = None if options.clips is None else _film_options(options)
    orders, judged = ([], set()) if films is None else _orders(films)
    out = new_folder(options.out or Path("runs") / f"paper-{time.strftime('%Y%m%d-%H%M%S')}", "run folder")
    _describe(out, {"clips": [order.clip for order in orders], "picture": options.picture})
    with _progress("paper", experiments.STEPS) as move:
        done = iter(range(1, experiments.STEPS + 1))
        found = experiments.experiments(lambda: move(next(done)), options.picture)
    console, troubles, answers = make_console(120), [], None
    if films is not None:
        answers, troubles = _watch_paper(out, orders, judged, films, console)
    claims = verdicts(found, answers)
    write_claims(claims, out)
    paper_figures(found, out)
    console.print(claim_table(claims))
    console.print(f"claims and figures: {out}", soft_wrap=True)
    for trouble in dict.fromkeys(troubles):
        _note(f"{trouble}; the trace up to there is kept")
    return 2 if troubles else 0


def _film_options(options: "Paper") -> "Video":
    """Return the options of `video` for the clips of `paper`."""
    from lgmd_gym.cli.options import Video

    return Video(clips=(str(options.clips),), crashes=options.crashes)


def _watch_paper(
    out: Path, orders: "list[Order]", judged: set[Path], films: "Video", console: Console
) -> "tuple[list[Detection], list[str]]":
    """Watch the clips by every choice, print the tables, and return the paper's choice's answers."""
    from lgmd_gym.video.clips import tables as clips_tables
    from lgmd_gym.video.clips.batch import detection
    from lgmd_gym.video.clips.playback import CHOICES

    orders = [order._replace(folder=_clip_folder(out, order.clip)) for order in orders]
    answers, troubles = {}, []
    for name, choice in CHOICES.items():
        watched = _watch_all(orders, name, choice, f"-{name}", films)
        troubles += [item.trouble for item in watched if item.trouble]
        answers[name] = [
            detection(order, order.folder / f"trace-{name}.csv", item.summary.fps)
            for order, item in zip(orders, watched, strict=True)
            if order.clip in judged
        ]
    for name in ("paper", "calm"):
        console.print(clips_tables.detection_table(f"{name}: {CHOICES[name].describe()}", answers[name]))
    described = {name: choice.describe() for name, choice in CHOICES.items()}
    console.print(clips_tables.choice_table(answers, described))
    return answers["paper"], troubles
