"""Formulas of the documentation as SVG, drawn without script or network."""

import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def formula_svg():
    pytest.importorskip("sphinx")
    sys.path.insert(0, str(DOCS))
    try:
        from math_svg import formula_svg
    finally:
        sys.path.remove(str(DOCS))
    return formula_svg


def box(svg):
    return [float(value) for value in re.search(r'viewBox="([^"]*)"', svg)[1].split()]


def test_a_formula_has_the_size_of_the_text_and_its_source(formula_svg):
    svg = formula_svg("E <\n 0")
    assert 'aria-label="E &lt; 0"' in svg
    assert 'fill="currentColor"' in svg
    left, top, width, height = box(svg)
    assert (left, top < 0.0, 6.0 < height < 14.0, width > 2 * height) == (0.0, True, True, True)
    assert float(re.search(r"width:([\d.]+)em", svg)[1]) == pytest.approx(width / 12, abs=1e-3)


def test_a_fraction_extends_below_the_line(formula_svg):
    below = [sum(box(formula_svg(text))[1::2]) for text in ("x", r"\dfrac{x}{y}")]
    assert below[1] > below[0] + 3.0
    aligned = re.search(r"vertical-align:([-\d.]+)em", formula_svg(r"\dfrac{x}{y}"))[1]
    assert float(aligned) == pytest.approx(-below[1] / 12, abs=2e-3)


def test_a_formula_that_cannot_be_drawn_is_refused(formula_svg):
    with pytest.raises(ValueError, match="cases"):
        formula_svg(r"\begin{cases} 1 \end{cases}")


def test_every_formula_of_the_pages_can_be_drawn(formula_svg):
    found = 0
    for page in DOCS.rglob("*.md"):
        text = re.sub(
            r"^```.*?^```|`[^`]*`|^    .*?$", "", page.read_text(encoding="utf-8"), flags=re.S | re.M
        )
        for formula in re.findall(r"\$\$(.+?)\$\$", text, re.S) + re.findall(
            r"(?<!\$)\$([^$]+)\$(?!\$)", text
        ):
            formula_svg(formula)
            found += 1
    assert found >= 30
