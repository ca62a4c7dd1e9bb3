"""The grids of a Euro NCAP suite as a figure: colour, letter and number in each cell."""

from lgmd_gym.report.case_grids import CaseGrid, GridCell
from lgmd_gym.report.figures import ReportFigure
from lgmd_gym.report.svg import INK, SOFT, Element, element, label, new_panel

CELL, LINE, HEAD, TOP = 34.0, 24.0, 66.0, 50.0  # width and height of a cell, row headings, title [px]
# For colour-blind readers and grey prints, lightness falls to red, and a letter repeats the colour.
CELL_COLOURS = {
    "green": ("#8fd3bd", "G"),
    "yellow": ("#f5e58a", "Y"),
    "orange": ("#f0a552", "O"),
    "brown": ("#9a6233", "B"),
    "red": ("#8c1c3a", "R"),
    "contact": ("#b3a2c7", "C"),
    "premature": ("#c4c0b8", "P"),
}
DARK_CELLS = ("brown", "red")
COLUMNS = (
    "condition",
    "agent",
    "family",
    "ego_speed_km_h",
    "column",
    "column_value",
    "colour",
    "runs",
    "contacts",
    "premature",
    "highest_relative_impact_speed_km_h",
)


def grid_figure(grids: list[CaseGrid], condition: str) -> ReportFigure | None:
    """Return the grids of all agents under one condition; None without a grid."""
    if not grids:
        return None
    lines = [
        (condition, grid.agent, grid.family, head, grid.axis, column, cell.colour, *_values(cell))
        for grid in grids
        for head, cells in grid.lines
        for column, cell in zip(grid.columns, cells, strict=True)
        if cell is not None
    ]
    title = f"Euro NCAP grids, {condition}"
    return ReportFigure(f"grids-{condition}", title, list(map(_panel, grids)), [], COLUMNS, lines)


def _values(cell: GridCell) -> tuple[int, int, int, str]:
    return cell.runs, cell.contacts, cell.premature, f"{cell.impact_kmh:.3f}"


def _panel(grid: CaseGrid) -> Element:
    """Draw one grid: a row per ego speed, and the quantity of the columns below the title."""
    size = max(HEAD + CELL * len(grid.columns) + 8, 240.0), TOP + LINE * len(grid.lines) + 10
    root = new_panel(grid.title, size, agent=grid.agent, family=grid.family)
    label(root, 4, 14, grid.title, font_size=12, font_weight=600)
    label(root, HEAD, 28, grid.axis, font_size=10, class_="soft", fill=SOFT)
    for index, column in enumerate(grid.columns):
        label(root, HEAD + CELL * (index + 0.5), TOP - 6, str(column), "middle")
    for row, (head, cells) in enumerate(grid.lines):
        y = TOP + LINE * row
        label(root, HEAD - 5, y + LINE / 2 + 4, head, "end")
        for index, cell in enumerate(cells):
            if cell is not None:
                _draw_cell(root, HEAD + CELL * index, y, cell)
    return root


def _draw_cell(root: Element, x: float, y: float, cell: GridCell) -> None:
    colour, letter = CELL_COLOURS[cell.colour]
    text_colour = "#ffffff" if cell.colour in DARK_CELLS else INK
    group = element(root, "g")
    element(group, "title", cell.tooltip)
    element(group, "rect", x=x + 1, y=y + 1, width=CELL - 2, height=LINE - 2, fill=colour)
    style = {"class_": "cell", "fill": text_colour}
    label(group, x + CELL / 2, y + LINE / 2 + 4, cell.text, "middle", **style)
    label(group, x + CELL - 4, y + 9, letter, "end", font_size=8, **style)
