"""Parts that clutter consists of, as columns of numbers until all of them are placed at once."""

import numpy as np

from lgmd_gym.camera.clutter.sites import Places, Sites
from lgmd_gym.camera.objects import MODEL_MARK, OBJECT
from lgmd_gym.camera.roadside import PLANT_RANGE

MARK_RANGE = 90.0
"""Range of small marks on the ground, farther than which they cover some hundredths of a pixel [m]."""

Value = np.ndarray | float
_FIELDS = ("length", "width", "height", "shade", "base", "model", "range", "braking")


def part(
    sites: Sites,
    model: Value,
    size: tuple[Value, Value, Value],
    shade: Value,
    *,
    along: Value = 0.0,
    out: Value = 0.0,
    base: Value = 0.0,
    turn: Value = 0.0,
    distance: float = PLANT_RANGE,
    braking: Value = 0.0,
) -> np.ndarray:
    """Return one part per site.

    Args:
        sites: Where.
        model: Model of the objects.
        size: Length, width and height of the top [m].
        shade: Grey of the body.
        along: Distance ahead of the site [m].
        out: Distance beyond the edge, or to the right of the centre line [m].
        base: Height of the underside [m].
        turn: Heading relative to the direction of travel, to the right [rad].
        distance: Range from the lens [m].
        braking: Whether the brake lights are on.

    Returns:
        Columns for `records_of`, float64, shape (12, n).
    """
    columns = np.empty((12, len(sites.place)))
    values = (sites.place, along, out, turn, *size, shade, base, model, distance, braking)
    for row, value in zip(columns, values, strict=True):
        row[:] = value
    return columns


def mark(
    sites: Sites,
    size: tuple[Value, Value],
    shade: Value,
    *,
    along: Value = 0.0,
    out: Value = 0.0,
    turn: Value = 0.0,
    distance: float = MARK_RANGE,
) -> np.ndarray:
    """Return one rectangle on the ground per site; see `part`."""
    return part(sites, MODEL_MARK, (*size, 0.0), shade, along=along, out=out, turn=turn, distance=distance)


def records_of(parts: list[np.ndarray], places: Places) -> tuple[np.ndarray, np.ndarray]:
    """Return `OBJECT` records of all parts, and the number of the place of each one; shape (n,)."""
    columns = np.concatenate([np.zeros((12, 0)), *parts], axis=1)
    owner = columns[0].astype(np.int64)
    along, out, turn = columns[1], columns[2], columns[3]
    at = places.select(owner)
    right, cos, sin = at.side * out, np.cos(turn), np.sin(turn)
    records = np.zeros(len(owner), OBJECT)
    records["x"] = at.x + along * at.cos - right * at.sin
    records["y"] = at.y + along * at.sin + right * at.cos
    records["cos"], records["sin"] = at.cos * cos - at.sin * sin, at.sin * cos + at.cos * sin
    for name, values in zip(_FIELDS, columns[4:], strict=True):
        records[name] = values
    return records, owner
