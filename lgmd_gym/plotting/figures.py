"""Figures of episodes, neuron layers and camera frames."""

from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.plotting.style import COLOURS, FigureFile, saved_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from lgmd_gym.neuron import LGMD

LAYER_TITLES = {
    "P": "P: luminance change with persistence",
    "E": "E: excitation",
    "I": "I: delayed inhibition",
    "S": "S: excitation minus inhibition",
    "G": "G: grouped excitation",
}


def episode_figure(
    file: FigureFile, title: str, episodes: dict[str, dict[str, np.ndarray]], alert_level: float
) -> "Figure":
    """Plot spike frequency, speed and gap over time, one line per agent; save and return the figure.

    Args:
        file: Destination.
        title: Title of the figure.
        episodes: Time series by agent (keys: `lgmd_gym.benchmark.episode.SERIES`).
        alert_level: The neuron's T_sf, drawn as a horizontal line [spikes/s].
    """
    with saved_figure(file, 3, 1, sharex=True, figsize=(7.5, 6.0)) as (figure, axes):
        frequency, speed, gap = axes
        figure.suptitle(title)
        for index, (agent, series) in enumerate(episodes.items()):
            line: dict[str, Any] = {"color": COLOURS[index % len(COLOURS)], "label": agent}
            frequency.plot(series["time"], series["spike_frequency"], **line)
            speed.plot(series["time"], series["ego_speed"] / KMH, **line)
            gap.plot(series["time"], series["gap"], **line)
            _mark_end(speed, gap, series, line["color"])
        frequency.axhline(alert_level, color="0.5", linestyle="--", linewidth=1.0)
        frequency.annotate(
            f"T_sf = {alert_level:g}",
            (0.01, alert_level),
            xycoords=("axes fraction", "data"),
            va="bottom",
            color="0.4",
            fontsize=8,
        )
        frequency.set(ylabel="spike frequency\n[spikes/s]", ylim=(0, None))
        speed.set(ylabel="ego speed [km/h]", ylim=(0, None))
        gap.set(ylabel="gap [m]", xlabel="time [s]   (× contact, ● end without contact)", ylim=(0, None))
        if not any(np.isfinite(series["gap"]).any() for series in episodes.values()):
            gap.text(0.5, 0.5, "no vehicle in the ego's path", transform=gap.transAxes, ha="center")
        speed.legend(loc="best", ncols=2, fontsize=8)
    return figure


def _mark_end(speed: Any, gap: Any, series: dict[str, np.ndarray], colour: str) -> None:
    """Mark the end of an episode on the speed and gap axes."""
    contact = series["gap"][-1] <= 1e-6
    marker = {"marker": "x" if contact else "o", "color": colour, "markersize": 6 if contact else 4}
    speed.plot(series["time"][-1], series["ego_speed"][-1] / KMH, **marker)
    gap.plot(series["time"][-1], series["gap"][-1], **marker)


def layers_figure(file: FigureFile, neuron: "LGMD", frame: np.ndarray | None = None) -> "Figure":
    """Draw the layers of a neuron at its last frame; save and return the figure.

    Args:
        file: Destination.
        neuron: Single neuron (`num=None`) that has processed at least one frame.
        frame: The last frame, shape (height, width), drawn first if given.

    Raises:
        ValueError: For a batch of neurons.
    """
    if neuron.num is not None:
        raise ValueError(f"neuron must be a single neuron, got a batch of {neuron.num}; use LGMD(shape)")
    layers = neuron.layers
    images = {} if frame is None else {"L: luminance": (frame, 0.0, 255.0)}
    for name, title in LAYER_TITLES.items():
        top = max(float(np.abs(layers[name]).max()), 1.0)
        images[title] = layers[name], -top if name == "P" else 0.0, top
    with saved_figure(file, 2, 3, grid=False, figsize=(10.0, 4.4)) as (figure, axes):
        for axis in axes.flat:
            axis.axis("off")
        for axis, (title, (values, low, high)) in zip(axes.flat, images.items(), strict=False):
            image = axis.imshow(values, cmap="gray", vmin=low, vmax=high, interpolation="nearest")
            axis.set_title(title, fontsize=9)
            figure.colorbar(image, ax=axis, shrink=0.7)
    return figure


def contact_sheet(file: FigureFile, frames: dict[str, dict[str, np.ndarray]]) -> "Figure":
    """Draw grey frames in a labelled table; save and return the figure.

    Args:
        file: Destination.
        frames: Frames by row label and column label, uint8, shape (height, width). Rows may lack columns.

    Raises:
        ValueError: If there is no frame.
    """
    columns = list(dict.fromkeys(column for row in frames.values() for column in row))
    if not columns:
        raise ValueError("frames must contain at least one frame, got none")
    aspect = max(frame.shape[0] / frame.shape[1] for row in frames.values() for frame in row.values())
    size = (0.3 + 2.0 * len(columns), 0.25 + 2.0 * aspect * len(frames))
    options: dict[str, Any] = {"pil_kwargs": {"optimize": True}}
    with saved_figure(
        file, len(frames), len(columns), grid=False, save_options=options, figsize=size, squeeze=False
    ) as (figure, axes):
        figure.get_layout_engine().set(w_pad=0.01, h_pad=0.01, wspace=0.01, hspace=0.01)
        for row, label in zip(axes, frames, strict=True):
            for axis, column in zip(row, columns, strict=True):
                axis.set(xticks=[], yticks=[], frame_on=False)
                if column in frames[label]:
                    frame = frames[label][column]
                    axis.imshow(frame, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
            row[0].set_ylabel(label, fontsize=8)
        for axis, column in zip(axes[0], columns, strict=True):
            axis.set_title(column, fontsize=8)
    return figure
