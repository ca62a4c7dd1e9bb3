"""Sphinx extension that draws LaTeX formulas as SVG in the page, with matplotlib: no script and no network.

Formulas between `$` and `$$` are matplotlib's mathtext, a subset of LaTeX. They take the colour and size of
the text, and screen readers get the LaTeX source.
"""

from html import escape

import numpy as np
from docutils import nodes
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

EM = 12.0  # size of the drawn text, which is 1 em of the page
FONT = FontProperties(math_fontfamily="stix")
LETTERS = {Path.MOVETO: "M", Path.LINETO: "L", Path.CURVE3: "Q", Path.CURVE4: "C"}  # of SVG


def formula_svg(latex: str) -> str:
    """Return a formula as an SVG element.

    Raises:
        ValueError: If mathtext cannot draw it.
    """
    text = " ".join(latex.split())
    outline = TextPath((0.0, 0.0), f"${text}$", size=EM, prop=FONT)
    box = outline.get_extents()
    width, bottom, top = box.x1 + 0.5, min(box.y0, 0.0) - 0.5, max(box.y1, 0.0) + 0.5
    parts = [
        "Z" if code == Path.CLOSEPOLY else LETTERS[code] + " ".join(map(_point, points.reshape(-1, 2)))
        for points, code in outline.iter_segments(simplify=False)
    ]
    return (
        f'<svg class="math" role="img" aria-label="{escape(text)}" fill="currentColor" '
        f'viewBox="0 {-top:.2f} {width:.2f} {top - bottom:.2f}" '
        f'style="width:{width / EM:.3f}em;height:{(top - bottom) / EM:.3f}em;'
        f'vertical-align:{bottom / EM:.3f}em">'
        f'<path d="{"".join(parts)}"/></svg>'
    )


def _point(point: np.ndarray) -> str:
    """Return a point of a path; the vertical axis of SVG points downwards."""
    return f"{point[0]:.2f},{-point[1]:.2f}"


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write an inline formula."""
    translator.body.append(formula_svg(node.astext()))
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula as a paragraph."""
    translator.body.append(f'<p class="math">{formula_svg(node.astext())}</p>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, object]:
    """Register the renderer under the name `svg`."""
    app.add_html_math_renderer("svg", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
