# pyright: standard
# Not strict: matplotlib states few types.
"""Figures of a comparison."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.analysis.froc import FrocPoint
from lgmd_gym.benchmark.summary import AgentSummary
from lgmd_gym.comparison.clips import ClipScore
from lgmd_gym.comparison.stimuli import ALARM, StimulusResult
from lgmd_gym.plotting.style import COLOURS, saved_figure
from lgmd_gym.statistics.intervals import Rate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANELS = (
    *("dark square approaches", "dark square recedes", "passes at 0.3 m/s"),
    *("approaches in panorama", "passes in panorama", "approaches in grating"),
)
LONG_NAME = 20  # characters of a model above which a legend has fewer columns
_STYLES = ("-", "--", ":")
_FALSE_TICKS = (0.0, 0.25, 1.0, 3.0, 10.0, 30.0, 100.0)


def _line(index: int) -> Values:
    """Return the line of a model, distinct for 21 models; equal curves show as lines of several widths."""
    return {
        "color": COLOURS[index % len(COLOURS)],
        "linestyle": _STYLES[index // len(COLOURS) % len(_STYLES)],
        "linewidth": 1.0 + 0.14 * index,
        "zorder": 3.0 - 0.05 * index,
    }


def stimulus_figure(file: Path, results: Sequence[StimulusResult]) -> None:
    """Plot the spike frequency of every model over time, one panel per stimulus of `PANELS`."""
    models = list(dict.fromkeys(item.model for item in results))
    with saved_figure(file, 2, 3, figsize=(10.5, 5.6), sharex=True, sharey=True) as (figure, axes):
        for axis, name in zip(axes.flat, PANELS, strict=True):
            for item in results:
                if item.stimulus.name == name:
                    axis.plot(item.time, item.frequency, label=item.model, **_line(models.index(item.model)))
            axis.axhline(ALARM, color="0.6", linewidth=0.8)
            axis.set_title(name, fontsize=9)
            axis.set_yscale("symlog", linthresh=50.0)
        for axis in axes[1]:
            axis.set_xlabel("time [s]; contact at 3 s")
        figure.supylabel("spike frequency [spikes/s]", fontsize=9)
        _legend(figure, axes.flat[0])


def approach_figure(file: Path, results: Sequence[StimulusResult]) -> None:
    """Plot lead and peak of the response over l/|v| of a dark square on a plain background."""
    models = list(dict.fromkeys(item.model for item in results))
    with saved_figure(file, 1, 2, figsize=(9.0, 3.6)) as (figure, axes):
        for index, model in enumerate(models):
            chosen = [r for r in results if r.model == model and np.isfinite(r.stimulus.l_over_v)]
            x = [item.stimulus.l_over_v for item in chosen]
            for axis, values in zip(axes, ([r.lead for r in chosen], [r.peak for r in chosen]), strict=True):
                axis.plot(x, values, marker="o", markersize=3, label=model, **_line(index))
        axes[0].set_ylabel(f"first {ALARM:g} spikes/s before contact [s]")
        axes[1].set_ylabel("highest spike frequency [spikes/s]")
        axes[1].set_yscale("symlog", linthresh=50.0)
        for axis in axes:
            axis.set_xlabel("l/|v| [s]")
        _legend(figure, axes[0])


def froc_figure(file: Path, curves: Mapping[str, Sequence[FrocPoint]], lead_s: float) -> None:
    """Plot the share of detected threats over false alarms per km."""
    with saved_figure(file, 1, 1, figsize=(7.0, 4.6)) as (figure, axis):
        for index, (model, points) in enumerate(curves.items()):
            shares = [point.detected.k / max(point.detected.n, 1) for point in points]
            axis.plot([point.false_per_km for point in points], shares, label=model, **_line(index))
        points = next(iter(curves.values()))
        chance = [(point.false_per_km, point.chance) for point in points]
        axis.plot(*zip(*chance, strict=True), color="0.6", linewidth=1.0, label="chance (first model)")
        axis.set_xscale("symlog", linthresh=1.0)
        axis.set_xticks(_FALSE_TICKS, [f"{tick:g}" for tick in _FALSE_TICKS])
        axis.set_xlim(-0.05, 32.0)
        axis.set_xlabel("false alarms per km")
        axis.set_ylabel(f"threats with an alarm 4 to {lead_s:g} s before contact")
        _legend(figure, axis)


def closed_loop_figure(file: Path, summaries: Sequence[AgentSummary]) -> None:
    """Plot avoided threats and false activations of every model, with their intervals."""
    with saved_figure(file, 1, 2, figsize=(8.0, 0.9 + 0.32 * len(summaries)), sharey=True) as (_, axes):
        heads = "threats avoided [%]", "false activations without threat [%]"
        for axis, head, rates in zip(
            axes,
            heads,
            ([s.avoided for s in summaries], [s.false_activations for s in summaries]),
            strict=True,
        ):
            _rates(axis, rates, [item.agent for item in summaries])
            axis.set_xlabel(head)


def clip_figure(file: Path, scores: Sequence[ClipScore]) -> None:
    """Plot the crashes that each model detects, with the interval, and the chance level."""
    with saved_figure(file, 1, 1, figsize=(6.5, 0.9 + 0.32 * len(scores))) as (_, axis):
        _rates(axis, [item.summary.hits for item in scores], [item.model for item in scores])
        for index, item in enumerate(scores):
            axis.plot(100.0 * item.summary.chance.probability, index, "|", color="0.4", markersize=12)
        axis.set_xlabel("crashes with an alarm in the 1.5 s before [%]; bar: chance")


def _rates(axis: "Axes", rates: Sequence[Rate], names: Sequence[str]) -> None:
    for index, rate in enumerate(rates):
        share = rate.k / max(rate.n, 1)
        errors = [[100.0 * max(share - rate.low, 0.0)], [100.0 * max(rate.high - share, 0.0)]]
        axis.errorbar(100.0 * share, index, xerr=errors, fmt="o", color=COLOURS[0], markersize=4, capsize=2)
    axis.set_yticks(range(len(names)), names)
    axis.set_ylim(len(names) - 0.5, -0.5)


def _legend(figure: Any, axis: "Axes") -> None:
    handles, labels = axis.get_legend_handles_labels()
    columns = 3 if max(map(len, labels)) > LONG_NAME else 5
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8)
