"""SVG panels of the report: axes, marks, lines and legends, readable on light and dark pages.

Colours are attributes, for programs without style sheets; the classes let `DARK_CSS` replace them.
"""

import re
from collections.abc import Iterable, Sequence
from typing import NamedTuple
from xml.etree import ElementTree

from lgmd_gym.plotting.style import COLOURS

Element = ElementTree.Element

INK, SOFT, RULE, PAGE = "#1c1c1c", "#555555", "#b5b5b5", "#ffffff"
DARK_CSS = (
    ".ink{fill:#e8e8e8}.soft{fill:#b4b4b4}.rule{stroke:#5c6066}.page{fill:#15181c}.halo{stroke:#15181c}"
    ".s0{fill:#f2f2f2}.l0{stroke:#f2f2f2}.s2{fill:#4aa3e0}.l2{stroke:#4aa3e0}"
)
FONT = "system-ui,sans-serif"
# Shapes around the origin, so that agents differ without colour, too.
SHAPES = (
    "M-4,0a4,4 0 1,0 8,0a4,4 0 1,0 -8,0z",
    "M-3.6,-3.6h7.2v7.2h-7.2z",
    "M0,-4.8L4.6,3.4H-4.6z",
    "M0,-5L5,0L0,5L-5,0z",
    "M0,4.8L4.6,-3.4H-4.6z",
)
DASHES = ("", "5 2", "2 2", "7 2 2 2", "1 3")
MAX_TICKS = 6  # of an axis
MAX_COLUMNS = 3  # of panels in a file
LEFT, RIGHT, TOP, BOTTOM = 40.0, 12.0, 26.0, 36.0
NOT_XML = re.compile(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class PanelAxis(NamedTuple):
    """Axis from 0 to `high` with its label."""

    label: str
    high: float


def element(parent: Element | None, tag: str, text: str = "", **attributes: object) -> Element:
    """Return a new element; `class_` and underscores in names stand for `class` and hyphens."""
    names = {key.rstrip("_").replace("_", "-"): _clean(value) for key, value in attributes.items()}
    item = Element(tag, names) if parent is None else ElementTree.SubElement(parent, tag, names)
    item.text = _clean(text) or None
    return item


def label(
    parent: Element, x: float, y: float, text: str, anchor: str = "start", **attributes: object
) -> Element:
    """Add a text in the colour of the page's text; attributes such as `font_size` replace the defaults."""
    style: dict[str, object] = {"class_": "ink", "fill": INK, "font_size": 11} | attributes
    return element(parent, "text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor, **style)


class Panel:
    """Coordinate system of one SVG panel.

    Args:
        title: Title above the axes.
        x: Horizontal axis.
        y: Vertical axis.
        size: Width and height [px].
        **data: Attributes `data-…` of the panel, for filters.

    Attributes:
        root: The `svg` element.
    """

    def __init__(
        self, title: str, x: PanelAxis, y: PanelAxis, size: tuple[float, float] = (320.0, 220.0), **data: str
    ) -> None:
        self.x, self.y, self.size = x, y, size
        self.root = new_panel(title, size, **data)
        label(self.root, LEFT, 15, title, font_size=12, font_weight=600)
        for value in ticks(x.high):
            place, _ = self.point(value, 0.0)
            self._rule((place, TOP), (place, size[1] - BOTTOM))
            label(self.root, place, size[1] - BOTTOM + 14, f"{value:g}", "middle", class_="soft", fill=SOFT)
        for value in ticks(y.high):
            _, place = self.point(0.0, value)
            self._rule((LEFT, place), (size[0] - RIGHT, place))
            label(self.root, LEFT - 5, place + 4, f"{value:g}", "end", class_="soft", fill=SOFT)
        label(self.root, (LEFT + size[0] - RIGHT) / 2, size[1] - 6, x.label, "middle")
        middle = (TOP + size[1] - BOTTOM) / 2
        label(self.root, 11, middle, y.label, "middle", transform=f"rotate(-90 11 {middle:.1f})")

    def point(self, x: float, y: float) -> tuple[float, float]:
        """Return the place of a point of data [px]."""
        width, height = self.size[0] - LEFT - RIGHT, self.size[1] - TOP - BOTTOM
        return LEFT + width * x / self.x.high, TOP + height * (1.0 - y / self.y.high)

    def group(self, agent: str) -> Element:
        """Return a new group for the marks of one agent."""
        return element(self.root, "g", data_agent=agent)

    def line(self, group: Element, points: Iterable[tuple[float, float]], series: int) -> None:
        """Draw a line through points of data, in the style of a series."""
        places = " ".join("{:.1f},{:.1f}".format(*self.point(*point)) for point in points)
        index = series % len(COLOURS)
        element(
            group,
            "polyline",
            points=places,
            fill="none",
            class_=f"l{index}",
            stroke=COLOURS[index],
            stroke_width=1.3,
            stroke_dasharray=DASHES[series % len(DASHES)],
        )

    def mark(self, group: Element, x: float, y: float, series: int, title: str, shift: float = 0.0) -> None:
        """Draw a mark with a hover title at a point of data, `shift` pixels to the right."""
        place_x, place_y = self.point(x, y)
        element(add_mark(group, place_x + shift, place_y, series), "title", title)

    def _rule(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        (x1, y1), (x2, y2) = start, end
        ends = {"x1": f"{x1:.1f}", "y1": f"{y1:.1f}", "x2": f"{x2:.1f}", "y2": f"{y2:.1f}"}
        element(self.root, "line", class_="rule", stroke=RULE, stroke_width=0.6, **ends)


def new_panel(title: str, size: tuple[float, float], **data: str) -> Element:
    """Return an empty `svg` element with a name for screen readers."""
    width, height = size
    names = {f"data_{key}": value for key, value in data.items()}
    return element(
        None,
        "svg",
        class_="panel",
        viewBox=f"0 0 {width:g} {height:g}",
        width=f"{width:g}",
        height=f"{height:g}",
        role="img",
        aria_label=title,
        font_family=FONT,
        **names,
    )


def add_mark(parent: Element, x: float, y: float, series: int) -> Element:
    """Add the mark of a series, whose colour and shape repeat after 35 series."""
    index = series % len(COLOURS)
    return element(
        parent,
        "path",
        d=SHAPES[series % len(SHAPES)],
        transform=f"translate({x:.1f} {y:.1f})",
        class_=f"s{index} halo",
        fill=COLOURS[index],
        stroke=PAGE,
        stroke_width=0.8,
    )


def legend_mark(series: int) -> Element:
    """Return a small `svg` element with the mark of a series."""
    root = element(None, "svg", viewBox="-7 -7 14 14", width=14, height=14, aria_hidden="true")
    add_mark(root, 0.0, 0.0, series)
    return root


def ticks(high: float) -> list[float]:
    """Return round numbers from 0 to `high`, at most `MAX_TICKS` of them.

    Example:
        >>> ticks(80.0)
        [0.0, 20.0, 40.0, 60.0, 80.0]
    """
    step = next(step for step in _steps() if high / step < MAX_TICKS)
    return [step * number for number in range(int(high / step + 1e-9) + 1)]


def _steps() -> Iterable[float]:
    power = 1.0
    while True:
        yield from (power, 2 * power, 5 * power)
        power *= 10.0


def to_text(root: Element) -> str:
    """Return an element as text, for a place inside an HTML page."""
    return ElementTree.tostring(root, encoding="unicode")


def file_text(title: str, panels: Sequence[Element], legend: Sequence[str] = ()) -> str:
    """Return a stand-alone SVG file of panels in rows, with a legend of series above them."""
    columns = min(MAX_COLUMNS, max(len(panels), 1))
    width = max((float(panel.get("width", 0)) for panel in panels), default=320.0)
    top = 34.0 + 16.0 * -(-len(legend) // columns)
    root = element(None, "svg", font_family=FONT)
    element(root, "title", title)
    element(root, "style", f"@media (prefers-color-scheme:dark){{{DARK_CSS}}}")
    element(root, "rect", width="100%", height="100%", class_="page", fill=PAGE)
    label(root, 10, 20, title, font_size=14, font_weight=600)
    for series, name in enumerate(legend):
        x, y = 16 + series % columns * width, 40 + 16.0 * (series // columns)
        add_mark(root, x, y - 4, series)
        label(root, x + 10, y, name)
    for start in range(0, len(panels), columns):
        row = panels[start : start + columns]
        for column, panel in enumerate(row):
            panel = ElementTree.fromstring(to_text(panel))
            panel.set("x", f"{column * width:g}")
            panel.set("y", f"{top:g}")
            root.append(panel)
        top += max(float(panel.get("height", 0)) for panel in row)
    full = f"{width * columns:g}", f"{top + 6:g}"
    root.attrib |= {"xmlns": "http://www.w3.org/2000/svg", "width": full[0], "height": full[1]}
    root.set("viewBox", "0 0 {} {}".format(*full))
    return to_text(root) + "\n"


def _clean(value: object) -> str:
    """Return a value as text without characters that XML does not allow."""
    return NOT_XML.sub("\ufffd", str(value))
