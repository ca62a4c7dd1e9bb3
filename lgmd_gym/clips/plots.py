"""The figure of one processed clip; matplotlib is imported on first use."""

from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.clips.playback import PlaybackConfig
from lgmd_gym.clips.summary import BINS, ClipSummary
from lgmd_gym.plotting.style import COLOURS, STYLE, load_pyplot

MAX_PICTURES = 5


def clip_figure(
    path: Path, title: str, summary: ClipSummary, config: PlaybackConfig, crash_s: float | None
) -> None:
    """Draw pictures at the alarms and the time series of F, K, spikes and spike frequency.

    Args:
        path: PNG file to write.
        title: Name of the clip.
        summary: Summary of the clip.
        config: Neuron parameters and frame processing.
        crash_s: Time of the crash, marked by a line [s]; None for none.
    """
    plt = load_pyplot()
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(9.0, 8.6), layout="constrained")
        figure.suptitle(f"{title}   ({config.describe(summary.fps)})", fontsize=10)
        grid = figure.add_gridspec(5, 1, height_ratios=(1.35, 1, 1, 0.55, 1.2))
        _draw_pictures(figure, grid[0], summary.pictures()[-MAX_PICTURES:])
        bottom = figure.add_subplot(grid[4])
        axes = [figure.add_subplot(grid[row], sharex=bottom) for row in (1, 2, 3)]
        series = summary.series()
        _draw_series([*axes, bottom], series, config)
        for axis in (*axes, bottom):
            for label, time, _ in summary.pictures():
                if label == "alarm begins":
                    axis.axvline(time, color=COLOURS[5], linewidth=1.0, alpha=0.8)
            if crash_s is not None:
                axis.axvline(crash_s, color=COLOURS[4], linewidth=1.6, linestyle="--")
        for axis in axes:
            axis.tick_params(labelbottom=False)
        if crash_s is not None:
            _annotate(bottom, (crash_s, 0.97), " crash", COLOURS[4])
        bottom.set_xlabel("time [s]   (orange: an alarm begins after 1/3 s without alarm)")
        bottom.set_xlim(0.0, max(float(series["time"][-1]), 1.0 / summary.fps))
        figure.savefig(path)
        plt.close(figure)


def _draw_pictures(figure: Any, cell: Any, pictures: list[tuple[str, float, np.ndarray]]) -> None:
    """Draw the pictures side by side."""
    row = cell.subgridspec(1, max(len(pictures), 3))
    for index, (label, time, picture) in enumerate(pictures):
        axis = figure.add_subplot(row[index])
        axis.imshow(picture)
        axis.set_title(f"{label}\n{time:.2f} s", fontsize=8)
        axis.set_axis_off()


def _draw_series(axes: list[Any], series: dict[str, np.ndarray], config: PlaybackConfig) -> None:
    """Draw F, K, spikes and frequency, each on its own axes with its threshold."""
    time, p = series["time"], config.params
    inhibition, potential, raster, frequency = axes
    inhibition.plot(time, series["ffi"], color=COLOURS[2])
    inhibition.set_ylabel("F̂, mean change\nof the frame\n[grey levels]")
    threshold = p.sigma_1 * p.t_f
    if np.isfinite(threshold) and series["ffi"].max() > 0.6 * threshold:
        inhibition.axhline(threshold, color="0.5", linestyle=":", linewidth=1.0)
        _annotate(
            inhibition, (0.995, threshold + 0.3), f"inhibition grows above {threshold:g}", "0.4", data="y"
        )
    potential.plot(time, series["membrane_potential"], color=COLOURS[6], label="K")
    potential.plot(time, series["adapted_potential"], color=COLOURS[0], label="K̂, adapted")
    potential.axhline(p.t_sp, color="0.5", linestyle=":", linewidth=1.0)
    _annotate(potential, (0.995, p.t_sp + 0.01), f"first spike at T_sp = {p.t_sp:g}", data="y")
    potential.set_ylim(0.45, 1.02)
    potential.set_ylabel("membrane\npotential")
    potential.legend(loc="upper left", fontsize=8, ncols=2)
    width = 1.0 if len(time) < BINS // 8 else 0.4
    raster.vlines(time, 0.0, series["spikes"], color=COLOURS[0], linewidth=width)
    raster.set_ylabel("spikes\nper frame")
    frequency.plot(time, series["spike_frequency"], color=COLOURS[0])
    alarm = series["spike_frequency"] >= p.t_sf
    frequency.fill_between(time, 0.0, series["spike_frequency"], where=alarm, color=COLOURS[1], alpha=0.35)
    frequency.axhline(p.t_sf, color=COLOURS[1], linestyle="--", linewidth=1.0)
    _annotate(frequency, (0.995, 1.04 * p.t_sf), f"alarm from T_sf = {p.t_sf:g}", COLOURS[1], data="y")
    frequency.set_ylabel("spike frequency\n[spikes/s]")
    for axis in (inhibition, raster, frequency):
        axis.set_ylim(bottom=0.0)


def _annotate(axis: Any, at: tuple[float, float], text: str, colour: str = "0.4", data: str = "x") -> None:
    """Write a small text; the coordinate `data` is in data units, the other a fraction of the axes."""
    units = ("data", "axes fraction") if data == "x" else ("axes fraction", "data")
    side = "left" if data == "x" else "right"
    box = {"facecolor": "white", "edgecolor": "none", "alpha": 0.75, "pad": 1.0}
    axis.annotate(text, at, xycoords=units, va="top" if data == "x" else "bottom", ha=side, color=colour,
                  fontsize=8, bbox=box, zorder=4)  # fmt: skip
