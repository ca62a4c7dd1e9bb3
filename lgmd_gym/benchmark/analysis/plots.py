"""Figures of benchmark runs."""

from typing import TYPE_CHECKING, Any

from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.plotting.style import COLOURS, FigureFile, saved_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from lgmd_gym.benchmark.analysis.compare import Comparison
    from lgmd_gym.benchmark.analysis.froc import FrocCurve, FrocPoint

FALSE_PER_KM_TICKS = (0.0, 0.5, 1.0, 3.0, 10.0, 30.0, 100.0)  # linear below 1, logarithmic above
LABELLED_THRESHOLDS = (15.0, 30.0, 60.0, 120.0)  # [spikes/s]


def difference_figure(file: FigureFile, comparisons: "list[Comparison]") -> "Figure":
    """Plot paired differences with their 95 % intervals, one panel per quantity; save and return the figure.

    Args:
        file: Destination.
        comparisons: One line each.
    """
    names = list(dict.fromkeys(item.name for comparison in comparisons for item in comparison.differences))
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    size = (10.0, rows * (1.1 + 0.42 * len(comparisons)))
    with saved_figure(file, rows, columns, figsize=size, squeeze=False) as (figure, axes):
        for axis in axes.flat[len(names) :]:
            axis.set_visible(False)
        for index, (name, axis) in enumerate(zip(names, axes.flat, strict=False)):
            _plot_differences(axis, name, comparisons, labels=index % columns == 0)
    return figure


def _plot_differences(axis: Any, name: str, comparisons: "list[Comparison]", labels: bool) -> None:
    """Plot one quantity; comparison i is at y = i."""
    axis.axvline(0.0, color="0.4", linewidth=1.0)
    unit = ""
    for height, comparison in enumerate(comparisons):
        item = next((item for item in comparison.differences if item.name == name), None)
        if item is None:
            continue
        unit, change = item.unit, item.change
        if change.low is not None and change.high is not None:
            ends = [change.low, change.high]
            axis.plot(ends, [height, height], color=COLOURS[2], linewidth=2.5, solid_capstyle="butt")
        axis.plot(change.value, height, "o", color=COLOURS[2], markersize=5)
    axis.set_title(name, fontsize=9)
    axis.set_xlabel(f"B − A [{unit}]", fontsize=8)
    axis.set_ylim(len(comparisons) - 0.5, -0.5)
    texts = [_comparison_label(comparison) for comparison in comparisons] if labels else []
    axis.set_yticks(range(len(comparisons)), texts, fontsize=7)


def _comparison_label(item: "Comparison") -> str:
    return f"{item.name_b}\n− {item.name_a}" + (f"\n{item.condition}" if item.condition else "")


def froc_figure(file: FigureFile, curves: "dict[str, list[FrocCurve]]", lead_time: float) -> "Figure":
    """Plot detections against false alarms per km, one panel per condition; save and return the figure.

    Args:
        file: Destination.
        curves: Curves by condition; one line each.
        lead_time: Latest start of a detection before contact [s].
    """
    size = (1.0 + 4.6 * len(curves), 3.9)
    with saved_figure(file, 1, len(curves), figsize=size, squeeze=False, sharey=True) as (figure, axes):
        for axis, (condition, of_condition) in zip(axes[0], curves.items(), strict=True):
            for colour, curve in zip(COLOURS, of_condition, strict=False):
                _plot_froc(axis, curve, colour)
            distance = of_condition[0].points[0].distance / 1000
            axis.set_title(f"{condition}; {distance:.2f} km without threat", fontsize=9)
            axis.set_xscale("symlog", linthresh=1.0)
            highest = max(point.false_per_km for curve in of_condition for point in curve.points)
            axis.set_xticks(FALSE_PER_KM_TICKS, [f"{tick:g}" for tick in FALSE_PER_KM_TICKS])
            axis.set_xticks([], minor=True)
            top = next((x for x in FALSE_PER_KM_TICKS if x >= max(highest, 1.0)), FALSE_PER_KM_TICKS[-1])
            axis.set(xlim=(-0.05, 1.05 * top), ylim=(-0.02, 1.02), xlabel="false alarms per km")
            axis.legend(fontsize=7, loc="center right")
        axes[0][0].set_ylabel(f"threats with an alarm 4 to {lead_time:g} s before contact")
    return figure


def _plot_froc(axis: Any, curve: "FrocCurve", colour: str) -> None:
    points = curve.points
    false_per_km = [point.false_per_km for point in points]
    detected = [point.detected.k / max(point.detected.n, 1) for point in points]
    label = f"{curve.contrast} (n = {points[0].detected.n})"
    axis.plot(false_per_km, detected, "o-", color=colour, markersize=2.5, linewidth=1.2, label=label)
    if curve.contrast == "all":
        chance = [point.chance for point in points]
        axis.plot(false_per_km, chance, ":", color="0.5", linewidth=1.2, label="chance: random windows")
        _label_thresholds(axis, points, list(zip(false_per_km, detected, strict=True)))


def _label_thresholds(
    axis: Any, points: "tuple[FrocPoint, ...]", positions: list[tuple[float, float]]
) -> None:
    """Write some thresholds next to their points; equal points share a label."""
    labels: dict[tuple[float, float], list[str]] = {}
    for point, position in zip(points, positions, strict=True):
        if point.threshold in LABELLED_THRESHOLDS:
            labels.setdefault(position, []).append(f"{point.threshold:g}")
    for position, texts in labels.items():
        offset = {"xytext": (3, -8), "textcoords": "offset points"}
        axis.annotate(", ".join(texts), position, fontsize=7, **offset)


def trace_figure(file: FigureFile, episodes: dict[str, dict[str, Any]], alert_level: float) -> "Figure":
    """Plot spike frequency and speed over time, one line per agent; save and return the figure.

    Args:
        file: Destination.
        episodes: Time series by agent (keys: `lgmd_gym.benchmark.episode.SERIES`).
        alert_level: The neuron's T_sf, drawn as a horizontal line [spikes/s].
    """
    with saved_figure(file, 2, 1, sharex=True, figsize=(6.4, 3.2)) as (figure, (frequency, speed)):
        for colour, (agent, series) in zip(COLOURS, episodes.items(), strict=False):
            frequency.plot(series["time"], series["spike_frequency"], color=colour, label=agent)
            speed.plot(series["time"], series["ego_speed"] / KMH, color=colour, label=agent)
        frequency.axhline(alert_level, color="0.5", linestyle="--", linewidth=1.0)
        frequency.set(ylabel="spikes/s", ylim=(0, None))
        speed.set(ylabel="speed [km/h]", xlabel="time [s]", ylim=(0, None))
        handles, agents = speed.get_legend_handles_labels()
        figure.legend(handles, agents, loc="outside upper center", fontsize=7, ncols=4)
    return figure
