"""Figure of the failure maps: one row of maps per agent."""

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from failure_map_planes import Map, Plane

from lgmd_gym.errors import counted
from lgmd_gym.plotting.style import COLOURS, saved_figure

LEVEL = 0.9  # of the contour

AGENT_LINE: dict[str, Any] = {"color": COLOURS[1], "linewidth": 3.0, "solid_capstyle": "projecting"}
BOUND_LINE: dict[str, Any] = {"color": COLOURS[0], "linewidth": 1.4, "linestyle": "--"}

LEFT_OUT = "0.85"  # grey
LEAST_WIDTH = 6.4  # of the figure, for its title and legend [inches]


def to_shares(rates: Map) -> np.ndarray:
    """Return rates as shares, shape (rows, columns), NaN where left out."""
    return np.array(
        [[math.nan if rate is None else rate.k / max(rate.n, 1) for rate in row] for row in rates]
    )


def edges(shares: np.ndarray) -> list[tuple[list[int], list[int]]]:
    """Return the edges between cells that reach the level and others, as x and y of their two ends.

    Args:
        shares: Share of each cell, shape (rows, columns), NaN if left out; cell (i, j) has its corners at
            x = j, j + 1 and y = i, i + 1.
    """

    def differ(*cells: tuple[int, int]) -> bool:
        one, other = (float(shares[cell]) for cell in cells)
        return math.isfinite(one + other) and (one >= LEVEL) != (other >= LEVEL)

    found = []
    for i, j in np.ndindex(*shares.shape):
        if j and differ((i, j - 1), (i, j)):
            found.append(([j, j], [i, i + 1]))
        if i and differ((i - 1, j), (i, j)):
            found.append(([j, j + 1], [i, i]))
    return found


def draw_map(axes: Any, plane: Plane, rates: Map, bound: Map) -> None:
    """Draw a map as coloured cells with numbers, its contour, and that of the bound."""
    shares = to_shares(rates)
    axes.set_facecolor(LEFT_OUT)
    axes.pcolormesh(shares, cmap="Blues", vmin=0.0, vmax=1.1, edgecolors="white", linewidth=0.5)
    for (i, j), share in np.ndenumerate(shares):
        if math.isfinite(share):
            style = {"ha": "center", "va": "center", "color": "white" if share > 0.6 else "black"}
            axes.text(j + 0.5, i + 0.5, f"{100 * share:.0f}", fontsize=8, **style)
    for x, y in edges(shares):
        axes.plot(x, y, **AGENT_LINE)
    for x, y in edges(to_shares(bound)):
        axes.plot(x, y, **BOUND_LINE)
    axes.set_xticks(np.arange(len(plane.x.ticks)) + 0.5, plane.x.ticks, fontsize=8)
    axes.set_yticks(np.arange(len(plane.y.ticks)) + 0.5, plane.y.ticks, fontsize=8)
    axes.set_ylabel(plane.y.label, fontsize=8)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)


def draw(played: Sequence[tuple[Plane, dict[str, Map]]], chosen: argparse.Namespace) -> None:
    """Draw one row of maps per agent."""
    shape = len(chosen.agents), len(played)
    size = (max(0.3 + 2.65 * shape[1], LEAST_WIDTH), 1.1 + 2.2 * shape[0])
    with saved_figure(chosen.to, *shape, grid=False, squeeze=False, figsize=size) as (figure, panels):
        for row, agent in zip(panels, chosen.agents, strict=True):
            for axes, (plane, maps) in zip(row, played, strict=True):
                draw_map(axes, plane, maps[agent], maps[chosen.bound])
            row[0].set_ylabel(f"{agent}\n\n{row[0].get_ylabel()}")
        for top, bottom, (plane, _) in zip(panels[0], panels[-1], played, strict=True):
            top.set_title(plane.title, fontsize=9)
            bottom.set_xlabel(plane.x.label, fontsize=8)
        lines = [panels[0, 0].plot([], [], **style)[0] for style in (AGENT_LINE, BOUND_LINE)]
        left_out = panels[0, 0].fill([], [], color=LEFT_OUT)[0]
        names = [f"edge of {LEVEL:.0%} avoided", f"the same for {chosen.bound}", "left out"]
        figure.legend([*lines, left_out], names, loc="outside lower center", ncols=3, fontsize=8)
        worlds = counted(chosen.worlds, "test world")
        figure.suptitle(f"Contacts avoided without premature braking in {worlds} [%]")
