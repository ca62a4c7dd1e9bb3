"""Every figure of the package, in one matplotlib style; matplotlib is loaded on first use."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from lgmd_gym.neuron import LGMD

# Okabe & Ito's palette, told apart by colour-blind readers, darkest first.
COLOURS = ("#000000", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
STYLE = {
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.dpi": 110,
    "font.size": 9,
    "grid.alpha": 0.3,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
}


def episode_figure(
    path: Path, title: str, episodes: dict[str, dict[str, np.ndarray]], alert_level: float
) -> None:
    """Draw spike frequency, speed and gap over time, one line per agent, and save it.

    Args:
        path: Where the PNG goes.
        title: The case's name.
        episodes: Agent to its time series (`lgmd_gym.benchmark.episode.SERIES`).
        alert_level: The neuron's T_sf, drawn as a line [spikes/s].
    """
    plt = _pyplot()
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 1, sharex=True, figsize=(7.5, 6.0), layout="constrained")
        figure.suptitle(title)
        colours = _colours(list(episodes))
        for agent, series in episodes.items():
            look: dict[str, Any] = {"color": colours[agent], "label": agent}
            axes[0].plot(series["time"], series["spike_frequency"], **look)
            axes[1].plot(series["time"], 3.6 * series["ego_speed"], **look)
            axes[2].plot(series["time"], series["gap"], **look)
            _mark_end(axes, series, colours[agent])
        axes[0].axhline(alert_level, color="0.5", linestyle="--", linewidth=1.0)
        axes[0].annotate(f"T_sf = {alert_level:g}", (0.01, alert_level), xycoords=("axes fraction", "data"),
                         va="bottom", color="0.4", fontsize=8)  # fmt: skip
        axes[0].set_ylabel("spike frequency\n[spikes/s]")
        axes[1].set_ylabel("ego speed [km/h]")
        axes[2].set_ylabel("gap [m]")
        axes[2].set_xlabel("time [s]   (× contact, ● stopped or resolved)")
        for axis in axes:
            axis.set_ylim(bottom=0)
        if not any(np.isfinite(series["gap"]).any() for series in episodes.values()):
            axes[2].text(0.5, 0.5, "nothing in the ego's path", transform=axes[2].transAxes, ha="center")
        axes[1].legend(loc="best", ncols=2, fontsize=8)
        figure.savefig(path)
        plt.close(figure)


def layers(path: Path, neuron: "LGMD", frame: np.ndarray | None = None) -> None:
    """Draw the maps of a neuron's last frame and save them.

    Args:
        path: Where the PNG goes.
        neuron: A single neuron (`num=None`) that has seen at least one frame.
        frame: The frame itself, shape (height, width), drawn first if given.

    Raises:
        ValueError: For a batch of neurons.
    """
    if neuron.num is not None:
        raise ValueError(f"layers draws a single neuron, got a batch of {neuron.num}; pass LGMD(shape) alone")
    maps = neuron.layers
    titles = {
        "P": "P: change, with persistence",
        "E": "E: excitation",
        "I": "I: delayed inhibition",
        "S": "S: excitation left",
        "G": "G: grouped",
    }
    plt = _pyplot()
    pictures = {} if frame is None else {"L: luminance": (frame, 0.0, 255.0)}
    for name, title in titles.items():
        top = max(float(np.abs(maps[name]).max()), 1.0)
        pictures[title] = maps[name], -top if name == "P" else 0.0, top
    with plt.rc_context({**STYLE, "axes.grid": False}):
        figure, axes = plt.subplots(2, 3, figsize=(10.0, 4.4), layout="constrained")
        for axis in axes.flat:
            axis.axis("off")
        for axis, (title, (values, low, high)) in zip(axes.flat, pictures.items(), strict=False):
            image = axis.imshow(values, cmap="gray", vmin=low, vmax=high, interpolation="nearest")
            axis.set_title(title, fontsize=9)
            figure.colorbar(image, ax=axis, shrink=0.7)
        figure.savefig(path)
        plt.close(figure)


def _mark_end(axes: Any, series: dict[str, np.ndarray], colour: str) -> None:
    """Mark how an episode ended on the speed and gap axes."""
    contact = series["gap"][-1] <= 1e-6
    marker = {"marker": "x" if contact else "o", "color": colour, "markersize": 6 if contact else 4}
    axes[1].plot(series["time"][-1], 3.6 * series["ego_speed"][-1], **marker)
    axes[2].plot(series["time"][-1], series["gap"][-1], **marker)


def _colours(agents: list[str]) -> dict[str, str]:
    return {agent: COLOURS[index % len(COLOURS)] for index, agent in enumerate(agents)}


def _pyplot() -> Any:
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    return pyplot


def contact_sheet(path: Path, frames: dict[str, dict[str, np.ndarray]]) -> None:
    """Draw grey frames in a table, with a label at each row and column, and save it.

    Args:
        path: Where the PNG goes.
        frames: Row label to column label to frame, uint8, shape (height, width); rows may lack columns.

    Raises:
        ValueError: If there is no frame at all.
    """
    columns = list(dict.fromkeys(column for row in frames.values() for column in row))
    if not columns:
        raise ValueError("contact_sheet needs at least one frame, got none")
    aspect = max(frame.shape[0] / frame.shape[1] for row in frames.values() for frame in row.values())
    plt = _pyplot()
    with plt.rc_context({**STYLE, "axes.grid": False}):
        size = (0.3 + 2.0 * len(columns), 0.25 + 2.0 * aspect * len(frames))
        figure, axes = plt.subplots(
            len(frames), len(columns), figsize=size, squeeze=False, layout="constrained"
        )
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
        figure.savefig(path, pil_kwargs={"optimize": True})
        plt.close(figure)
