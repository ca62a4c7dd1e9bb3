# pyright: standard
# Not strict: matplotlib states few types.
"""The figures of `lgmd-gym paper`; matplotlib is imported on first use."""

import math
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.clips.playback import PLAYBACK_CONFIGS
from lgmd_gym.clips.published import NEW
from lgmd_gym.clips.study import HEADLINE, ClipTrace, Crash
from lgmd_gym.neuron import LGMDParams
from lgmd_gym.paper.backgrounds import SHAPES, Grating, Screen
from lgmd_gym.paper.claims import LOCUST_SLOPE
from lgmd_gym.paper.experiments import (
    CONTACT,
    CONTRASTS,
    FPS,
    L_OVER_V,
    MODELS,
    SHADES,
    SPATIAL,
    TEMPORAL,
    ExperimentResults,
    GratingResponse,
    StimulusResponse,
    line_fit,
)
from lgmd_gym.paper.stimuli import stimulus_frames
from lgmd_gym.plotting.style import COLOURS, STYLE, load_pyplot, saved_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import GridSpecFromSubplotSpec, SubplotSpec
    from matplotlib.image import AxesImage

ALARM_LEVEL = 30.0  # T_sf [spikes/s]
ALARM_RANGE = (15.0, 30.0)  # T_sf in the paper [spikes/s]
MODEL_COLOURS = dict(zip(MODELS, COLOURS, strict=False))


def paper_figures(results: ExperimentResults, folder: Path) -> list[Path]:
    """Draw every figure into a folder and return their paths."""
    plt = load_pyplot()
    paths = []
    names = ("1-gratings", "2-looming-in-gratings", "3-panorama", "4-biology")
    with plt.rc_context(STYLE):
        for name, draw in zip(names, (_gratings, _looming, _panorama, _biology), strict=True):
            path = folder / f"{name}.png"
            figure = draw(plt, results)
            figure.savefig(path)
            plt.close(figure)
            paths.append(path)
    return paths


def _gratings(plt: ModuleType, results: ExperimentResults) -> "Figure":
    """Draw six gratings, and the highest K of three models over contrast, spatial and temporal frequency."""
    models = ("paper", "fixed inhibition", "neither adaptation nor silencing")
    figure = plt.figure(figsize=(11.0, 7.6), layout="constrained")
    figure.suptitle(
        "Gratings alone: highest membrane potential K (rest 0.5, first spike 0.7); grey numbers: mean F̂"
    )
    grid = figure.add_gridspec(3, 1, height_ratios=(0.8, 1.2, 1.2))
    top, screen = grid[0].subgridspec(1, len(SPATIAL)), Screen(shape=SHAPES["gratings"])
    for index, spatial in enumerate(SPATIAL):
        axis = figure.add_subplot(top[index])
        axis.imshow(
            next(stimulus_frames(screen, 1.0, Grating(spatial=spatial))), cmap="gray", vmin=0, vmax=255
        )
        axis.set_title(f"{spatial:.3g} periods/m", fontsize=8)
        axis.set_axis_off()
    rows = (
        (results.gratings, SPATIAL, "periods/m", lambda item: item.grating.spatial, "contrast 1"),
        (results.low_contrast, CONTRASTS, "contrast", lambda item: item.grating.contrast, "40 periods/m"),
    )
    image = None
    for row, (responses, values, label, key, note) in enumerate(rows, start=1):
        cell = grid[row].subgridspec(1, len(models))
        for column, model in enumerate(models):
            axis = figure.add_subplot(cell[column])
            image = _heat_map(axis, responses, values, key, model)
            axis.set_title(f"{model}\n{note}", fontsize=8)
            axis.set_xlabel("temporal frequency [Hz]", fontsize=8)
            axis.set_ylabel(label if column == 0 else "")
        figure.colorbar(image, ax=figure.axes[-1], label="highest K")
    return figure


def _heat_map(
    axis: "Axes",
    responses: list[GratingResponse],
    values: tuple[float, ...],
    key: Callable[[GratingResponse], float],
    model: str,
) -> "AxesImage":
    """Draw the highest K of a model, with F̂ as text, over a property of the gratings and their frequency."""
    table = np.zeros((len(values), len(TEMPORAL)))
    axis.grid(visible=False)
    for item in responses:
        row, column = values.index(key(item)), TEMPORAL.index(item.grating.temporal)
        table[row, column] = item.potential[model]
        if model == "paper":
            axis.text(column, row, f"{item.ffi:.0f}", ha="center", va="center", fontsize=7, color="0.45")
    axis.set_xticks(range(len(TEMPORAL)), [f"{value:g}" for value in TEMPORAL])
    axis.set_yticks(range(len(values)), [f"{value:.3g}" for value in values])
    return axis.imshow(table, vmin=0.5, vmax=1.0, cmap="OrRd", aspect="auto")


def _looming(plt: ModuleType, results: ExperimentResults) -> "Figure":
    """Draw dark and light squares that loom in gratings: six panels of frames, spike frequency and K."""
    spatial = list(dict.fromkeys(item.spatial for item in results.looming))
    figure = plt.figure(figsize=(11.0, 8.6), layout="constrained")
    figure.suptitle("A square looms in a drifting grating, l/|v| = 100 ms, 30 Hz")
    grid = figure.add_gridspec(2, len(spatial))
    shared: list[Axes | None] = [None, None]
    for (row, (shade, luminance)), (column, periods) in product(
        enumerate(SHADES.items()), enumerate(spatial)
    ):
        panel = [item for item in results.looming if (item.luminance, item.spatial) == (luminance, periods)]
        cells = grid[row, column].subgridspec(3, 1, height_ratios=(0.45, 1.0, 0.6))
        _strip(figure, cells[0], panel[-1].response, f"{shade} square, {periods:g} periods/m")
        axes = _response_axes(figure, cells, shared, (row, column), last_row=1)
        for item, colour in zip(panel, COLOURS, strict=False):
            response, time = item.response, item.response.time - CONTACT
            label = f"contrast {item.contrast:g} (F̂ {response.ffi[5:60].mean():.0f})"
            axes[0].plot(time, response.frequency["paper"], color=colour, label=label)
            axes[1].plot(time, response.potential["paper"], color=colour)
        axes[1].set_xlim(-1.5, 0.0)
        if row == 1:
            axes[1].set_xlabel("time to contact [s]")
        axes[0].legend(fontsize=7, loc="upper left", bbox_to_anchor=(0.0, 0.93))
    return figure


def _panorama(plt: ModuleType, results: ExperimentResults) -> "Figure":
    """Draw dark and light squares that approach, recede and pass in a panorama: six panels."""
    motions = {
        "approaches": ("approaching",),
        "recedes": ("receding",),
        "passes": ("passing at 0.108 m/s", "passing at 0.3 m/s"),
    }
    figure = plt.figure(figsize=(11.0, 8.6), layout="constrained")
    figure.suptitle("A square in a shifting panorama, 30 Hz")
    grid = figure.add_gridspec(2, len(motions))
    shared: list[Axes | None] = [None, None]
    for (row, shade), (column, (title, names)) in product(enumerate(SHADES), enumerate(motions.items())):
        responses = {name: results.panorama[f"{name}, {shade}"] for name in names}
        cells = grid[row, column].subgridspec(3, 1, height_ratios=(0.45, 1.0, 0.6))
        _strip(figure, cells[0], responses[names[-1]], f"{shade} square {title}")
        axes = _response_axes(figure, cells, shared, (row, column), last_row=1)
        for (name, response), colour in zip(responses.items(), COLOURS, strict=False):
            axes[0].plot(response.time, response.frequency["paper"], color=colour, label=name)
            axes[1].plot(response.time, response.potential["paper"], color=colour)
        axes[1].set_xlim(0.0, CONTACT)
        if row == 1:
            axes[1].set_xlabel("time [s]")
        if len(names) > 1:
            axes[0].legend(fontsize=7, loc="upper right")
    return figure


def _response_axes(
    figure: "Figure",
    cells: "GridSpecFromSubplotSpec",
    shared: "list[Axes | None]",
    place: tuple[int, int],
    last_row: int,
) -> "tuple[Axes, Axes]":
    """Return the axes of spike frequency and K of one panel, with the levels of the alarm and of spikes.

    Args:
        figure: The figure.
        cells: Cells of the panel; the axes are in the second and third.
        shared: Axes of the first panel, whose scale all panels have; those of this panel if there is none.
        place: Row and column of the panel.
        last_row: Row with numbers on the axis of time.
    """
    upper = figure.add_subplot(cells[1], sharey=shared[0])
    lower = figure.add_subplot(cells[2], sharex=upper, sharey=shared[1])
    shared[:] = shared[0] or upper, shared[1] or lower
    upper.axhspan(*ALARM_RANGE, color=COLOURS[5], alpha=0.4, linewidth=0.0)
    lower.axhline(LGMDParams().t_sp, color="0.5", linestyle=":", linewidth=1.0)
    lower.set_ylim(0.45, 1.03)
    upper.tick_params(labelbottom=False, labelleft=place[1] == 0)
    lower.tick_params(labelbottom=place[0] == last_row, labelleft=place[1] == 0)
    if place[1] == 0:
        upper.set_ylabel("spikes/s\n(orange: T_sf of the paper)", fontsize=8)
        lower.set_ylabel("K\n(dotted: T_sp)", fontsize=8)
    return upper, lower


def clip_figures(traces: Sequence[ClipTrace], crashes: Sequence[Crash], folder: Path) -> list[Path]:
    """Draw the responses to clips with and without a crash at the paper's setting, and return the files."""
    by_clip = {trace.clip: trace for trace in traces if trace.configuration == HEADLINE}
    paths: list[Path] = []
    for name, crashed in (("5-crashes", True), ("6-near-misses", False)):
        panels = [
            (crash, by_clip[crash.clip])
            for crash in crashes
            if (crash.crash_s is not None) == crashed and crash.clip in by_clip
        ]
        if not panels:
            continue
        columns = min(len(panels), 5)
        rows = -(-len(panels) // columns)
        paths.append(folder / f"{name}.png")
        size = (2.3 * columns + 0.6, 2.1 * rows + 0.5)
        with saved_figure(paths[-1], rows, columns, figsize=size, squeeze=False) as (figure, axes):
            figure.suptitle(f"{PLAYBACK_CONFIGS[HEADLINE].describe()}; orange: 15 to 30 spikes/s; red: crash")
            for axis in axes.flat[len(panels) :]:
                axis.set_axis_off()
            for index, (axis, (crash, trace)) in enumerate(zip(axes.flat, panels, strict=False)):
                _clip_panel(axis, crash, trace, index % columns == 0, index % columns == columns - 1)
                axis.set_xlabel("time [s]" if index + columns >= len(panels) else "")
    return paths


def _clip_panel(axis: "Axes", crash: Crash, trace: ClipTrace, left: bool, right: bool) -> None:
    """Draw spike frequency and K of one clip, with labels at the left and right end of a row."""
    time = np.arange(len(trace.spike_frequency)) / trace.fps
    axis.axhspan(*ALARM_RANGE, color=COLOURS[5], alpha=0.4, linewidth=0.0)
    axis.fill_between(time, trace.spike_frequency, step="mid", color=COLOURS[0], alpha=0.75, linewidth=0.0)
    axis.set_ylim(0.0, 150.0)
    axis.set_xlim(0.0, time[-1])
    axis.set_title(f"{crash.clip}{' (new)' if crash.group == NEW else ''}", fontsize=8)
    twin = axis.twinx()
    twin.plot(time, trace.membrane_potential, color=COLOURS[6], linewidth=1.1)
    twin.set_ylim(0.0, 1.02)
    twin.grid(visible=False)
    twin.spines["right"].set_visible(True)
    if crash.crash_s is not None:
        axis.axvline(crash.crash_s, color="red", linewidth=1.4)
        spread = crash.crash_s - crash.tolerance_s, crash.crash_s + crash.tolerance_s
        axis.axvspan(*spread, color="red", alpha=0.2, linewidth=0.0)
    if left:
        axis.set_ylabel("spikes/s")
    if right:
        twin.set_ylabel("K", color=COLOURS[6])
    twin.tick_params(labelright=right)
    axis.tick_params(labelleft=left)


def _biology(plt: ModuleType, results: ExperimentResults) -> "Figure":
    """Draw peak time and angle over l/|v|, approaches aligned at contact, and spikes by kind of motion."""
    figure, axes = plt.subplots(2, 2, figsize=(10.0, 7.6), layout="constrained")
    figure.suptitle(
        "Comparison with the locust (Gabbiani, Krapp & Laurent 1999): a dark square on grey, 30 Hz"
    )
    _draw_peaks(axes[0, 0], axes[0, 1], results)
    for item, colour in zip(results.approaches[4::2], COLOURS, strict=False):
        response = item.response
        contact = response.time[-1] + 1.0 / FPS
        label = f"l/|v| = {1000 * item.l_over_v:g} ms"
        axes[1, 0].plot(response.time - contact, response.frequency["paper"], color=colour, label=label)
    axes[1, 0].set_xlim(-1.6, 0.0)
    axes[1, 0].set_xlabel("time to contact [s]")
    axes[1, 0].set_ylabel("spike frequency [spikes/s]")
    axes[1, 0].axhline(ALARM_LEVEL, color=COLOURS[5], linewidth=1.2)
    axes[1, 0].legend(fontsize=8)
    kinds = list(next(iter(results.selectivity.values())))
    for index, (model, counts) in enumerate(results.selectivity.items()):
        at = np.arange(len(kinds)) + 0.27 * (index - 1)
        bars = axes[1, 1].bar(
            at, [counts[kind] for kind in kinds], 0.25, color=MODEL_COLOURS[model], label=model
        )
        axes[1, 1].bar_label(bars, fontsize=7)
    axes[1, 1].set_xticks(range(len(kinds)), [kind.replace(" at", "\nat") for kind in kinds])
    axes[1, 1].set_ylabel("spikes in 3 s")
    axes[1, 1].legend(fontsize=8)
    return figure


def _draw_peaks(left: "Axes", right: "Axes", results: ExperimentResults) -> None:
    """Draw the times of the peak and of the first alarm, and the angle of the square at these times."""
    x = np.array(L_OVER_V)
    for name, colour, marker in (("peak", COLOURS[0], "o"), ("alarm", COLOURS[1], "s")):
        y = np.array([getattr(item, name) for item in results.approaches])
        slope, intercept, half_width = line_fit(x, y)
        label = f"{name}: slope {slope:.2f} ± {half_width:.2f}, intercept {1000 * intercept:.0f} ms"
        left.plot(1000 * x, 1000 * y, marker, color=colour, label=label)
        left.plot(1000 * x, 1000 * (slope * x + intercept), color=colour, linewidth=1.0)
        angle = 2.0 * np.degrees(np.arctan(x / y))
        right.plot(1000 * x, angle, marker, color=colour, label=f"at the {name}")
    locust: Values = {"color": "0.6", "linestyle": "--"}
    left.plot(1000 * x, 1000 * LOCUST_SLOPE * x - 27.0, label="locust: 4.7 · l/|v| - 27 ms", **locust)
    left.set_ylabel("time before contact [ms]")
    left.set_ylim(0.0, 1500.0)
    angle = 2.0 * math.degrees(math.atan(1.0 / LOCUST_SLOPE))
    right.axhline(angle, label="locust: 24°, 27 ms before its peak", **locust)
    right.set_ylabel("angle of the square [deg]")
    right.set_ylim(0.0, 60.0)
    for axis in (left, right):
        axis.set_xlabel("l/|v| [ms]   (one frame is 33 ms)")
        axis.legend(fontsize=8)


def _strip(figure: "Figure", cell: "SubplotSpec", response: StimulusResponse, title: str) -> None:
    """Draw the stored frames of a stimulus in one row."""
    inner = cell.subgridspec(1, len(response.pictures), wspace=0.03)
    for index, (time, frame) in enumerate(response.pictures):
        axis = figure.add_subplot(inner[0, index])
        axis.imshow(frame, cmap="gray", vmin=0, vmax=255)
        axis.set_axis_off()
        axis.text(0.5, -0.05, f"{time:.2f} s", transform=axis.transAxes, va="top", ha="center", fontsize=6)
        if index == 0:
            axis.set_title(title, fontsize=8, loc="left")
