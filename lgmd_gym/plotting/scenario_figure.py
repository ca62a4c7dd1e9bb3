"""Figure of a scenario: the road from above at several times, and all speeds over time."""

from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.plotting.style import COLOURS, FigureFile, saved_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from lgmd_gym.envs.motion import Motion

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
    options: dict[str, Any] = {"gridspec_kw": {"height_ratios": ratios}, "figsize": size}
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


def _draw_view(axis: Any, motion: "Motion", index: int) -> None:
    """Draw the lanes, the way so far and the bodies at one time."""
    _draw_lanes(axis, motion, motion.positions[index, 0])
    for body, (x, y) in enumerate(motion.positions[index]):
        colour = COLOURS[body % len(COLOURS)]
        way = motion.positions[: index + 1, body]
        axis.plot(way[:, 0], -way[:, 1], color=colour, linewidth=0.8, alpha=0.6)
        corners = motion.positions[index, body] + _corners(motion.sizes[body], motion.headings[index, body])
        axis.fill(corners[:, 0], -corners[:, 1], color=colour, linewidth=0, zorder=3)
        axis.annotate(
            f"{body}" if body else "ego",
            (x, -y),
            color="white",
            ha="center",
            va="center",
            fontsize=7,
            zorder=4,
            clip_on=True,
        )


def _draw_lanes(axis: Any, motion: "Motion", ego: np.ndarray) -> None:
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


def _draw_speeds(axis: Any, motion: "Motion", times: np.ndarray) -> None:
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
    axis.legend(loc="best", ncols=3, fontsize=8)
