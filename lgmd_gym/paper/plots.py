# pyright: standard
# Not strict: matplotlib states few types.
"""The figures of `lgmd-gym paper`; matplotlib is imported on first use."""

import math
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.paper.backgrounds import SHAPES, Grating, Screen
from lgmd_gym.paper.claims import LOCUST_SLOPE
from lgmd_gym.paper.experiments import (
    CONTACT,
    CONTRASTS,
    DARK,
    FPS,
    L_OVER_V,
    MODELS,
    SPATIAL,
    TEMPORAL,
    ExperimentResults,
    GratingResponse,
    StimulusResponse,
    line_fit,
)
from lgmd_gym.paper.stimuli import stimulus_frames
from lgmd_gym.plotting.style import COLOURS, STYLE, load_pyplot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.gridspec import SubplotSpec
    from matplotlib.image import AxesImage

ALARM_LEVEL = 30.0  # T_sf [spikes/s]
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
    """Draw a square that looms in gratings: frames, spike frequency and F̂, one column per contrast."""
    contrasts = list(dict.fromkeys(item.contrast for item in results.looming))
    figure = plt.figure(figsize=(11.0, 7.4), layout="constrained")
    figure.suptitle("A square looms in a drifting grating, l/|v| = 100 ms, 30 Hz")
    grid = figure.add_gridspec(3, len(contrasts), height_ratios=(0.9, 1.2, 0.8))
    shared: list[Axes | None] = [None, None]
    for column, contrast in enumerate(contrasts):
        items = [item for item in results.looming if item.contrast == contrast]
        _strip(figure, grid[0, column], items[0].response, f"grating of contrast {contrast:g}")
        upper = figure.add_subplot(grid[1, column], sharey=shared[0])
        lower = figure.add_subplot(grid[2, column], sharex=upper, sharey=shared[1])
        shared = [shared[0] or upper, shared[1] or lower]
        for item, colour in zip(items, np.repeat(COLOURS[:3], 2), strict=True):
            dark, response = item.luminance == DARK, item.response
            label = f"{'dark' if dark else 'light'}, {item.spatial:g}/m"
            style = {"color": colour, "linestyle": "-" if dark else "--", "linewidth": 1.1}
            upper.plot(response.time - CONTACT, response.frequency["paper"], label=label, **style)
            lower.plot(response.time - CONTACT, response.ffi, **style)
        upper.axhline(ALARM_LEVEL, color=COLOURS[5], linewidth=1.2)
        lower.axhline(10.0, color="0.5", linestyle=":", linewidth=1.0)
        upper.set_xlim(-1.5, 0.0)
        lower.set_xlabel("time to contact [s]")
        if column == 0:
            upper.set_ylabel("spike frequency [spikes/s]\n(orange: T_sf = 30 at 30 Hz)")
            lower.set_ylabel("F̂ (dotted: 10,\ninhibition grows above)")
            upper.legend(fontsize=7, loc="upper left")
    return figure


def _panorama(plt: ModuleType, results: ExperimentResults) -> "Figure":
    """Draw objects that approach, recede and translate in a shifting panorama, one column each."""
    names = ("approaching, dark", "receding", "passing at 0.108 m/s", "passing at 0.3 m/s")
    figure = plt.figure(figsize=(12.0, 8.0), layout="constrained")
    figure.suptitle("An object in a shifting panorama, 30 Hz (orange: T_sf = 30 spikes/s)")
    grid = figure.add_gridspec(5, len(names), height_ratios=(0.9, 0.7, 0.45, 1.1, 0.7))
    for column, name in enumerate(names):
        response = results.panorama[name]
        _strip(figure, grid[0, column], response, name)
        axes = [figure.add_subplot(grid[row, column]) for row in (1, 2, 3, 4)]
        axes[0].plot(response.time, response.potential["paper"], color=COLOURS[6])
        axes[0].axhline(0.7, color="0.5", linestyle=":", linewidth=1.0)
        axes[0].set_ylim(0.45, 1.02)
        axes[1].vlines(response.time, 0.0, response.spikes["paper"], color=COLOURS[0], linewidth=1.0)
        axes[1].set_ylim(0.0, 10.0)
        for model, colour in MODEL_COLOURS.items():
            axes[2].plot(response.time, response.frequency[model], color=colour, label=model, linewidth=1.2)
        axes[2].axhline(ALARM_LEVEL, color=COLOURS[5], linewidth=1.2)
        axes[2].set_ylim(0.0, 250.0)
        axes[3].plot(response.time, response.ffi, color=COLOURS[2])
        axes[3].axhline(10.0, color="0.5", linestyle=":", linewidth=1.0)
        axes[3].set_ylim(0.0, 40.0)
        axes[3].set_xlabel("time [s]")
        labels = ("K (dotted: T_sp)", "spikes\nper frame", "spike frequency\n[spikes/s]", "F̂")
        for axis, label in zip(axes, labels, strict=True):
            axis.set_xlim(0.0, CONTACT)
            axis.set_ylabel(label if column == 0 else "")
            axis.tick_params(labelbottom=axis is axes[3], labelleft=column == 0)
        if column == 0:
            axes[2].legend(fontsize=7, loc="upper left")
    return figure


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
    """Draw the last four stored frames of a stimulus in two columns."""
    inner = cell.subgridspec(2, 2, wspace=0.03)
    for index, (time, frame) in enumerate(response.pictures[-4:]):
        axis = figure.add_subplot(inner[index // 2, index % 2])
        axis.imshow(frame, cmap="gray", vmin=0, vmax=255)
        axis.set_axis_off()
        axis.text(
            0.02,
            0.96,
            f"{time:.2f} s",
            transform=axis.transAxes,
            va="top",
            fontsize=6.5,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},
        )
        if index == 0:
            axis.set_title(title, fontsize=8, loc="left")
