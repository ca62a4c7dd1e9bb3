"""Figures of benchmark runs, in the style of `plots`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from lgmd_gym.plotting.figures import COLOURS, STYLE, _pyplot

if TYPE_CHECKING:
    from lgmd_gym.benchmark.analysis.compare import Comparison
    from lgmd_gym.benchmark.analysis.froc import Curve


TICKS = (0.0, 0.5, 1.0, 3.0, 10.0, 30.0, 100.0)  # false alarms per km; linear below 1


def difference_figure(path: Path | Any, found: "list[Comparison]") -> None:
    """Draw every paired difference with its 95 % interval, one panel per quantity, and save it.

    Args:
        path: PNG or SVG file, or an open binary file.
        found: The comparisons, one line each.
    """
    names = list(dict.fromkeys(line.name for item in found for line in item.differences))
    plt = _pyplot()
    columns = min(3, len(names))
    rows = -(-len(names) // columns)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            rows,
            columns,
            figsize=(10.0, rows * (1.1 + 0.42 * len(found))),
            squeeze=False,
            layout="constrained",
        )
        for axis in axes.flat[len(names) :]:
            axis.set_visible(False)
        for index, (name, axis) in enumerate(zip(names, axes.flat, strict=False)):
            _differences(axis, name, found, labels=index % columns == 0)
        figure.savefig(path, format=_format(path))
        plt.close(figure)


def _differences(axis: Any, name: str, found: "list[Comparison]", labels: bool) -> None:
    axis.axvline(0.0, color="0.4", linewidth=1.0)
    unit = ""
    for place, item in enumerate(found):
        line = next((line for line in item.differences if line.name == name), None)
        if line is None:
            continue
        unit = line.unit
        low, high = line.change.low, line.change.high
        if low is not None and high is not None:
            axis.plot([low, high], [place, place], color=COLOURS[2], linewidth=2.5, solid_capstyle="butt")
        axis.plot(line.change.value, place, "o", color=COLOURS[2], markersize=5)
    axis.set_title(name, fontsize=9)
    axis.set_xlabel(f"B − A [{unit}]", fontsize=8)
    axis.set_ylim(len(found) - 0.5, -0.5)
    axis.set_yticks(range(len(found)), [_pair(item) for item in found] if labels else [], fontsize=7)


def _pair(item: "Comparison") -> str:
    return f"{item.b}\n− {item.a}" + (f"\n{item.condition}" if item.condition else "")


def froc_figure(path: Path | Any, curves: "dict[str, list[Curve]]", lead: float) -> None:
    """Draw detection against false alarms per km, one panel per condition, one line per contrast.

    Args:
        path: PNG or SVG file, or an open binary file.
        curves: Condition to its curves.
        lead: The lead time that counts as detection [s].
    """
    plt = _pyplot()
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(
            1, len(curves), figsize=(1.0 + 4.6 * len(curves), 3.9), squeeze=False, sharey=True,
            layout="constrained",
        )  # fmt: skip
        for axis, (condition, items) in zip(axes[0], curves.items(), strict=True):
            for colour, curve in zip(COLOURS, items, strict=False):
                _froc(axis, curve, colour)
            axis.set_title(
                f"{condition}; {items[0].points[0].distance / 1000:.2f} km free of threat", fontsize=9
            )
            axis.set_xscale("symlog", linthresh=1.0)
            highest = max(point.false_per_km for item in items for point in item.points)
            axis.set_xticks(TICKS, [f"{tick:g}" for tick in TICKS])
            axis.set_xticks([], minor=True)
            top = next((tick for tick in TICKS if tick >= max(highest, 1.0)), TICKS[-1])
            axis.set(xlim=(-0.05, 1.05 * top), ylim=(-0.02, 1.02), xlabel="false alarms per km")
            axis.legend(fontsize=7, loc="lower right")
        axes[0][0].set_ylabel(f"threats alarmed 4 to {lead:g} s before contact")
        figure.savefig(path, format=_format(path))
        plt.close(figure)


def _froc(axis: Any, curve: "Curve", colour: str) -> None:
    points = curve.points
    label = f"{curve.group} (n = {points[0].detected.n})"
    axis.plot([p.false_per_km for p in points], [p.detected.k / max(p.detected.n, 1) for p in points],
              "o-", color=colour, markersize=2.5, linewidth=1.2, label=label)  # fmt: skip
    for point in points:
        if point.threshold in (15.0, 30.0, 60.0, 120.0):
            share = point.detected.k / max(point.detected.n, 1)
            axis.annotate(f"{point.threshold:g}", (point.false_per_km, share), fontsize=7, color=colour,
                          xytext=(3, -8), textcoords="offset points")  # fmt: skip
    if curve.group == "all":
        axis.plot([p.false_per_km for p in points], [p.chance for p in points], ":", color="0.5",
                  linewidth=1.2, label="chance: random windows")  # fmt: skip


def trace_figure(path: Path | Any, episodes: dict[str, dict[str, Any]], alert_level: float) -> None:
    """Draw spike frequency and speed over time, one line per agent, small, and save it.

    Args:
        path: PNG or SVG file, or an open binary file.
        episodes: Agent to its time series (`lgmd_gym.benchmark.episode.SERIES`).
        alert_level: The neuron's T_sf, drawn as a line [spikes/s].
    """
    plt = _pyplot()
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(2, 1, sharex=True, figsize=(6.4, 2.9), layout="constrained")
        for colour, (agent, series) in zip(COLOURS, episodes.items(), strict=False):
            axes[0].plot(series["time"], series["spike_frequency"], color=colour, label=agent)
            axes[1].plot(series["time"], 3.6 * series["ego_speed"], color=colour, label=agent)
        axes[0].axhline(alert_level, color="0.5", linestyle="--", linewidth=1.0)
        axes[0].set_ylabel("spikes/s")
        axes[1].set(ylabel="speed [km/h]", xlabel="time [s]")
        for axis in axes:
            axis.set_ylim(bottom=0)
        axes[1].legend(fontsize=7, ncols=2)
        figure.savefig(path, format=_format(path))
        plt.close(figure)


def _format(path: Path | Any) -> str:
    """Return the format of a file name; an open file gets SVG."""
    return path.suffix.lstrip(".") or "png" if isinstance(path, Path) else "svg"
