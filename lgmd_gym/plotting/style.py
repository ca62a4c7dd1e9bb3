"""The matplotlib style of all figures, and the context manager that creates and saves one."""

from collections.abc import Generator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO

from PIL import ImageFont

from lgmd_gym.aliases import Arguments
from lgmd_gym.processes.files import complete_file

# Palette of Okabe and Ito, which colour-blind readers can distinguish; darkest first.
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

FigureFile = Path | BinaryIO  # the suffix of a path sets the format; an open file receives SVG


def load_pyplot() -> Any:
    """Import and return `matplotlib.pyplot` with the Agg backend, which needs no display."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot

    return pyplot


@lru_cache
def load_font(size: int) -> ImageFont.FreeTypeFont:
    """Return DejaVu Sans, which matplotlib ships and which contains the characters of units."""
    import matplotlib as mpl

    return ImageFont.truetype(f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf", size)


@contextmanager
def saved_figure(
    file: FigureFile,
    rows: int,
    columns: int,
    *,
    grid: bool = True,
    save_options: Arguments | None = None,
    **subplot_options: Any,
) -> Generator[tuple[Any, Any], None, None]:
    """Create a figure with subplots and yield it with its axes; save and close it at the end of the block.

    Args:
        file: Destination; the file of a path is complete or absent.
        rows: Number of rows of subplots.
        columns: Number of columns of subplots.
        grid: Whether the axes have grid lines.
        save_options: Further arguments of `Figure.savefig`.
        **subplot_options: Further arguments of `pyplot.subplots`.
    """
    plt = load_pyplot()
    options = {"format": _format_of(file)} | (save_options or {})
    with plt.rc_context(STYLE | {"axes.grid": grid}):
        figure, axes = plt.subplots(rows, columns, layout="constrained", **subplot_options)
        try:
            yield figure, axes
            if isinstance(file, Path):
                with complete_file(file) as part:
                    figure.savefig(part, **options)
            else:
                figure.savefig(file, **options)
        finally:
            plt.close(figure)


def _format_of(file: FigureFile) -> str:
    return (file.suffix.lstrip(".") or "png") if isinstance(file, Path) else "svg"
