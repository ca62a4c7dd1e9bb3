"""The figure of one watched clip; matplotlib is loaded on first use."""

from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.plotting.style import COLOURS, STYLE, load_pyplot
from lgmd_gym.video.clips.playback import Choice
from lgmd_gym.video.clips.summary import BINS, Summary

MOST_PICTURES = 5


def clip_figure(path: Path, title: str, summary: Summary, choice: Choice, crash_s: float | None) -> None:
    """Draw pictures at the alarms, the inhibition, the potential, the spikes and their frequency.

    Args:
        path: Where the PNG goes.
        title: The clip's name.
        summary: What remains of the clip.
        choice: How it was watched.
        crash_s: Time of the crash, drawn as a line [s]; None for none.
    """
    plt = load_pyplot()
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(9.0, 8.6), layout="constrained")
        figure.suptitle(f"{title}   ({choice.describe(summary.fps)})", fontsize=10)
        grid = figure.add_gridspec(5, 1, height_ratios=(1.35, 1, 1, 0.55, 1.2))
        _draw_pictures(figure, grid[0], summary.pictures()[-MOST_PICTURES:])
        below = figure.add_subplot(grid[4])
        axes = [figure.add_subplot(grid[row], sharex=below) for row in (1, 2, 3)]
        series = summary.series()
        _draw_series([*axes, below], series, choice)
        for axis in (*axes, below):
            for what, time, _ in summary.pictures():
                if what == "alarm begins":
                    axis.axvline(time, color=COLOURS[5], linewidth=1.0, alpha=0.8)
            if crash_s is not None:
                axis.axvline(crash_s, color=COLOURS[4], linewidth=1.6, linestyle="--")
        for axis in axes:
            axis.tick_params(labelbottom=False)
        if crash_s is not None:
            _note(below, (crash_s, 0.97), " crash", COLOURS[4])
        below.set_xlabel("time [s]   (orange: an alarm begins after 1/3 s of quiet)")
        below.set_xlim(0.0, max(float(series["time"][-1]), 1.0 / summary.fps))
        figure.savefig(path)
        plt.close(figure)


def _draw_pictures(figure: Any, place: Any, pictures: list[tuple[str, float, np.ndarray]]) -> None:
    """Draw the kept pictures side by side."""
    row = place.subgridspec(1, max(len(pictures), 3))
    for index, (what, time, picture) in enumerate(pictures):
        axis = figure.add_subplot(row[index])
        axis.imshow(picture)
        axis.set_title(f"{what}\n{time:.2f} s", fontsize=8)
        axis.set_axis_off()


def _draw_series(axes: list[Any], series: dict[str, np.ndarray], choice: Choice) -> None:
    """Draw F, K, spikes and frequency, each on its axis with its threshold."""
    time, p = series["time"], choice.params
    inhibition, potential, raster, frequency = axes
    inhibition.plot(time, series["ffi"], color=COLOURS[2])
    inhibition.set_ylabel("F̂, change of the\nwhole picture\n[grey levels]")
    start = p.sigma_1 * p.t_f
    if np.isfinite(start) and series["ffi"].max() > 0.6 * start:
        inhibition.axhline(start, color="0.5", linestyle=":", linewidth=1.0)
        _note(inhibition, (0.995, start + 0.3), f"inhibition grows above {start:g}", "0.4", data="y")
    potential.plot(time, series["membrane_potential"], color=COLOURS[6], label="K")
    potential.plot(time, series["adapted_potential"], color=COLOURS[0], label="K̂, adapted")
    potential.axhline(p.t_sp, color="0.5", linestyle=":", linewidth=1.0)
    _note(potential, (0.995, p.t_sp + 0.01), f"first spike at T_sp = {p.t_sp:g}", "0.4", data="y")
    potential.set_ylim(0.45, 1.02)
    potential.set_ylabel("membrane\npotential")
    potential.legend(loc="upper left", fontsize=8, ncols=2)
    raster.vlines(
        time, 0.0, series["spikes"], color=COLOURS[0], linewidth=1.0 if len(time) < BINS // 8 else 0.4
    )
    raster.set_ylabel("spikes\na frame")
    frequency.plot(time, series["spike_frequency"], color=COLOURS[0])
    loud = series["spike_frequency"] >= p.t_sf
    frequency.fill_between(time, 0.0, series["spike_frequency"], where=loud, color=COLOURS[1], alpha=0.35)
    frequency.axhline(p.t_sf, color=COLOURS[1], linestyle="--", linewidth=1.0)
    _note(frequency, (0.995, 1.04 * p.t_sf), f"alarm from T_sf = {p.t_sf:g}", COLOURS[1], data="y")
    frequency.set_ylabel("spike frequency\n[spikes/s]")
    for axis in (inhibition, raster, frequency):
        axis.set_ylim(bottom=0.0)


def _note(axis: Any, at: tuple[float, float], text: str, colour: str, data: str = "x") -> None:
    """Write a small note; one coordinate is the data's, the other a fraction of the axes."""
    frame = ("data", "axes fraction") if data == "x" else ("axes fraction", "data")
    side = "left" if data == "x" else "right"
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
    axis.annotate(text, at, xycoords=frame, va="top" if data == "x" else "bottom", ha=side, color=colour,
                  fontsize=8, bbox=ground, zorder=4)  # fmt: skip
