# pyright: standard
# Not strict: matplotlib states few types.
"""Figures of episodes, scenarios, neuron layers and camera frames."""

from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.plotting.style import COLOURS, FigureFile, saved_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from lgmd_gym.envs.motion import Motion
    from lgmd_gym.neuron import LGMD


LAYER_TITLES = {
    "P": "P: luminance change with persistence",
    "E": "E: excitation",
    "I": "I: delayed inhibition",
    "S": "S: excitation minus inhibition",
    "G": "G: grouped excitation",
}


def episode_figure(
    file: FigureFile,
    title: str,
    episodes: dict[str, dict[str, np.ndarray]],
    alert_level: float,
    own_signal: str = "",
) -> "Figure":
    """Plot spike frequency, speed and gap over time, one line per agent; save and return the figure.

    Args:
        file: Destination.
        title: Title of the figure.
        episodes: Time series by agent (keys: `lgmd_gym.benchmark.episode.SERIES`).
        alert_level: The neuron's T_sf, drawn as a horizontal line [spikes/s].
        own_signal: Name of a user's neuron, whose signal has a unit of its own and no T_sf; else empty.
    """
    with saved_figure(file, 3, 1, sharex=True, figsize=(7.5, 6.0)) as (figure, axes):
        frequency, speed, gap = axes
        figure.suptitle(title)
        for index, (agent, series) in enumerate(episodes.items()):
            line: Arguments = {"color": COLOURS[index % len(COLOURS)], "label": agent}
            frequency.plot(series["time"], series["spike_frequency"], **line)
            speed.plot(series["time"], series["ego_speed"] / KMH, **line)
            gap.plot(series["time"], series["gap"], **line)
            _mark_end(speed, gap, series, line["color"])
        _set_signal(frequency, alert_level, own_signal, "spike frequency\n[spikes/s]")
        speed.set(ylabel="ego speed [km/h]", ylim=(0, None))
        gap.set(ylabel="gap [m]", xlabel="time [s]   (× contact, ● end without contact)", ylim=(0, None))
        if not any(np.isfinite(series["gap"]).any() for series in episodes.values()):
            gap.text(0.5, 0.5, "no vehicle in the ego's path", transform=gap.transAxes, ha="center")
        handles, agents = speed.get_legend_handles_labels()
        figure.legend(handles, agents, loc="outside lower center", fontsize=8, ncols=4)
    return figure


def _set_signal(axis: "Axes", alert_level: float, own_signal: str, label: str) -> None:
    """Label the axis of the neuron's signal, and draw T_sf unless the neuron is the user's."""
    if own_signal:
        axis.set(ylabel=f"signal of\n{own_signal}")
        return
    axis.axhline(alert_level, color="0.5", linestyle="--", linewidth=1.0)
    place = {"xycoords": ("axes fraction", "data"), "va": "bottom"}
    axis.annotate(f"T_sf = {alert_level:g}", (0.01, alert_level), color="0.4", fontsize=8, **place)
    axis.set(ylabel=label, ylim=(0, None))


def _mark_end(speed: Any, gap: Any, series: dict[str, np.ndarray], colour: str) -> None:
    """Mark the end of an episode on the speed and gap axes."""
    contact = series["gap"][-1] <= 1e-6
    marker = {"marker": "x" if contact else "o", "color": colour, "markersize": 6 if contact else 4}
    speed.plot(series["time"][-1], series["ego_speed"][-1] / KMH, **marker)
    gap.plot(series["time"][-1], series["gap"][-1], **marker)


def trace_figure(
    file: FigureFile, episodes: dict[str, Values], alert_level: float, own_signal: str = ""
) -> "Figure":
    """Plot spike frequency and speed over time, one line per agent; save and return the figure.

    Args:
        file: Destination.
        episodes: Time series by agent (keys: `lgmd_gym.benchmark.episode.SERIES`).
        alert_level: The neuron's T_sf, drawn as a horizontal line [spikes/s].
        own_signal: See `episode_figure`.
    """
    with saved_figure(file, 2, 1, sharex=True, figsize=(6.4, 3.2)) as (figure, (frequency, speed)):
        for colour, (agent, series) in zip(COLOURS, episodes.items(), strict=False):
            frequency.plot(series["time"], series["spike_frequency"], color=colour, label=agent)
            speed.plot(series["time"], series["ego_speed"] / KMH, color=colour, label=agent)
        _set_signal(frequency, alert_level, own_signal, "spikes/s")
        speed.set(ylabel="speed [km/h]", xlabel="time [s]", ylim=(0, None))
        handles, agents = speed.get_legend_handles_labels()
        figure.legend(handles, agents, loc="outside upper center", fontsize=7, ncols=4)
    return figure


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
    options: Arguments = {"pil_kwargs": {"optimize": True}}
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


VIEWS = 5
WIDTH = 9.0  # [in]
BEHIND, AHEAD, ASIDE = (12.0, 40.0), (20.0, 80.0), (6.0, 30.0)  # [m], least and greatest extent of a view
MARGIN = 4.0  # [m] around the bodies


def scenario_figure(file: FigureFile, title: str, motion: "Motion") -> "Figure":
    """Draw a scenario without braking: views from above that move with the ego, and speeds over time.

    Args:
        file: Destination.
        title: Title of the figure.
        motion: Motion of the ego and all actors.

    Returns:
        The figure; its first axes are the views from the start to the end, its last axis has the speeds.
    """
    shown = np.unique(np.linspace(0, len(motion.times) - 1, VIEWS).round().astype(int))
    behind, ahead, aside = _extent(motion, shown)
    height = WIDTH * 2 * aside / (behind + ahead)
    ratios = [*[height] * len(shown), 1.7]
    size = (WIDTH, sum(ratios) + 0.45 * len(ratios))
    options: Arguments = {"gridspec_kw": {"height_ratios": ratios}, "figsize": size}
    with saved_figure(file, len(ratios), 1, grid=False, **options) as (figure, axes):
        figure.suptitle(title)
        for axis, index in zip(axes[:-1], shown, strict=True):
            _draw_view(axis, motion, index)
            x, y = motion.positions[index, 0]
            axis.set(xlim=(x - behind, x + ahead), ylim=(-y - aside, -y + aside), aspect="equal")
            at_end = motion.contact and index == shown[-1]
            axis.set_ylabel(
                f"{motion.times[index]:.1f} s" + ("\ncontact" if at_end else ""), rotation=0, ha="right"
            )
        axes[-2].set_xlabel("distance from the ego's start [m]   (left of the ego is up)")
        _draw_speeds(axes[-1], motion, motion.times[shown])
    return figure


def _extent(motion: "Motion", shown: np.ndarray) -> tuple[float, float, float]:
    """Return how far the views reach behind, ahead of and to either side of the ego [m]."""
    relative = motion.positions[shown] - motion.positions[shown, :1]
    reach = motion.sizes.max(axis=1) / 2 + MARGIN
    near = np.abs(relative) <= (AHEAD[1], ASIDE[1])
    inside = near.all(axis=2)
    along = np.where(inside, relative[..., 0], 0.0)
    behind = np.clip((reach - along).max(), *BEHIND)
    ahead = np.clip((reach + along).max(), *AHEAD)
    aside = np.where(inside, np.abs(relative[..., 1]), 0.0) + motion.sizes[:, 1] / 2 + MARGIN
    return float(behind), float(ahead), float(np.clip(aside.max(), *ASIDE))


def _draw_view(axis: "Axes", motion: "Motion", index: int) -> None:
    """Draw the lanes, the way so far and the bodies at one time."""
    _draw_lanes(axis, motion, motion.positions[index, 0])
    for body, (x, y) in enumerate(motion.positions[index]):
        colour = COLOURS[body % len(COLOURS)]
        way = motion.positions[: index + 1, body]
        axis.plot(way[:, 0], -way[:, 1], color=colour, linewidth=0.8, alpha=0.6)
        corners = motion.positions[index, body] + _corners(motion.sizes[body], motion.headings[index, body])
        axis.fill(corners[:, 0], -corners[:, 1], color=colour, linewidth=0, zorder=3)
        style = {"color": "white", "fontsize": 7, "zorder": 4, "clip_on": True}
        axis.annotate(f"{body}" if body else "ego", (x, -y), ha="center", va="center", **style)


def _draw_lanes(axis: "Axes", motion: "Motion", ego: np.ndarray) -> None:
    """Draw the lanes near the ego."""
    reach = AHEAD[1] + BEHIND[1]
    for lane in motion.network.lanes_list():
        middle = lane.local_coordinates(ego + motion.origin)[0]
        along = np.linspace(max(middle - reach, 0.0), min(middle + reach, lane.length), 80)
        if along[0] >= along[-1]:
            continue
        sides = [
            np.array([lane.position(s, side * lane.width_at(s) / 2) for s in along]) - motion.origin
            for side in (-1, 1)
        ]
        outline = np.concatenate([sides[0], sides[1][::-1]])
        axis.fill(outline[:, 0], -outline[:, 1], color="0.9", linewidth=0, zorder=0)
        for side in sides:
            axis.plot(side[:, 0], -side[:, 1], color="0.7", linewidth=0.7, zorder=1)


def _corners(size: np.ndarray, heading: float) -> np.ndarray:
    """Return the corners of a rectangle around its centre, float64, shape (4, 2) [m]."""
    corners = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1)]) * size / 2
    cos, sin = np.cos(heading), np.sin(heading)
    return corners @ np.array([(cos, sin), (-sin, cos)])


def _draw_speeds(axis: "Axes", motion: "Motion", times: np.ndarray) -> None:
    """Draw the speed of every body over time, with lines at the times of the views."""
    for time in times:
        axis.axvline(time, color="0.85", linewidth=0.8, zorder=0)
    for body, name in enumerate(motion.names):
        colour = COLOURS[body % len(COLOURS)]
        line = {"linestyle": "-" if body else "--", "zorder": 2 if body else 3}  # visible on equal speeds
        axis.plot(motion.times, motion.speeds[:, body] / KMH, color=colour, label=name, **line)
    if motion.contact:
        axis.plot(motion.times[-1], motion.speeds[-1, 0] / KMH, marker="x", color=COLOURS[0])
    axis.set(xlabel="time [s]   (× contact)" if motion.contact else "time [s]", ylabel="speed [km/h]")
    axis.set(xlim=(0.0, max(motion.times[-1], 1e-3) * 1.01), ylim=(0.0, None))
    axis.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=6, fontsize=8)
