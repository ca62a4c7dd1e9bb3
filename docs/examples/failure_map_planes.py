"""Planes of the failure maps: two quantities each, and the case of each pair of values."""

import argparse
import math
from collections.abc import Callable, Sequence
from itertools import product
from typing import Any, NamedTuple

from lgmd_gym.benchmark.case import Case, make_case, to_mps
from lgmd_gym.camera.params import ROADS, CameraParams
from lgmd_gym.envs.families.curves import MAX_LATERAL
from lgmd_gym.rendering.playback import make_target
from lgmd_gym.statistics.intervals import Rate

SUITE = "failure-maps"
PLANES = ("vibration", "width", "brake", "curve", "height")
DEFAULT_PLANES = PLANES[:4]  # of the figure in the documentation
LOW_BOX_WIDTH = 2.0  # of the plane `height` [m]
GRIDS = {
    "textures": ([0.5, 1.0, 1.6, 2.5], "contrasts of the ground, relative to that of the world"),
    "widths": ([0.3, 0.5, 0.8, 1.2, 1.7, 2.5], "widths of the target [m]"),
    "decelerations": ([5.0, 6.0, 7.0, 8.0, 9.5], "decelerations of full braking [m/s²]"),
    "radii": ([60.0, 100.0, 200.0, 400.0, 800.0, math.inf], "radii of the curve [m]; inf for a straight"),
    "heights": ([0.3, 0.5, 0.8, 1.2, 1.7], "heights of the box [m]"),
    "speeds": ([20.0, 40.0, 60.0, 80.0, 100.0], "ego speeds of all planes but vibration [km/h]"),
}

Map = list[list[Rate | None]]  # rate of each cell by row and column; None for one that is left out


class Cell(NamedTuple):
    """One cell of a map: a case, and the road and the texture in place of the usual ones."""

    case: Case
    road: str | None = None
    texture: float | None = None


class Axis(NamedTuple):
    """One quantity of a map: its label and its values."""

    label: str
    values: Sequence[Any]

    @property
    def ticks(self) -> list[str]:
        """Labels of the values; the number of a road is its multiple of the measured motion."""
        special = {math.inf: "∞"} | {road: f"{road}\n{gain:g} ×" for road, gain in ROADS.items()}
        return [special.get(value) or f"{value:g}" for value in self.values]


class Plane(NamedTuple):
    """Two quantities, and the cell for their values and for the number of a world; None if left out."""

    title: str
    x: Axis
    y: Axis
    cell: Callable[[Any, Any, int], Cell | None]


def vibration_cell(road: str, texture: float, world: int) -> Cell:
    """Return the cell of a road and a texture contrast."""
    case = make_case(SUITE, "CCRs", f"road-{road}-texture-{texture:g}", ego_speed=to_mps(50))
    return Cell(case, road, texture)


def width_cell(width: float, speed_kmh: float, world: int) -> Cell:
    """Return the cell of a target width [m]."""
    name = f"width-{width:g}-v{speed_kmh:g}"
    return Cell(make_case(SUITE, "StandingBox", name, ego_speed=to_mps(speed_kmh), width=width))


def brake_cell(deceleration: float, speed_kmh: float, world: int) -> Cell:
    """Return the cell of a deceleration [m/s²]; dead time and build-up are those of the world's brake."""
    brake = {"max_deceleration": deceleration}
    name = f"brake-{deceleration:g}-v{speed_kmh:g}"
    return Cell(make_case(SUITE, "CCRs", name, ego_speed=to_mps(speed_kmh), config=brake))


def curve_cell(radius: float, speed_kmh: float, world: int) -> Cell | None:
    """Return the cell of a radius [m], infinite for a straight; None with too much lateral acceleration."""
    speed, name = to_mps(speed_kmh), f"radius-{radius:g}-v{speed_kmh:g}"
    if math.isinf(radius):
        return Cell(make_case(SUITE, "CCRs", name, ego_speed=speed))
    if speed**2 / radius > MAX_LATERAL:
        return None
    left = bool(world % 2)
    return Cell(make_case(SUITE, "CCRsCurve", name, ego_speed=speed, radius=radius, left=left))


def height_cell(height: float, speed_kmh: float, world: int) -> Cell:
    """Return the cell of a height [m] of a box."""
    name, speed = f"height-{height:g}-v{speed_kmh:g}", to_mps(speed_kmh)
    return Cell(make_case(SUITE, "StandingBox", name, ego_speed=speed, width=LOW_BOX_WIDTH, height=height))


def make_planes(chosen: argparse.Namespace) -> dict[str, Plane]:
    """Return the planes by name."""
    motion = Axis("road (1 ×: measured motion)", chosen.roads)
    contrast = Axis("contrast of the ground [×]", chosen.textures)
    width, speed = Axis("width [m]", chosen.widths), Axis("ego speed [km/h]", chosen.speeds)
    brake, radius = Axis("deceleration [m/s²]", chosen.decelerations), Axis("radius [m]", chosen.radii)
    height = Axis("height [m]", chosen.heights)
    return {
        "vibration": Plane("vibration, at 50 km/h", motion, contrast, vibration_cell),
        "width": Plane("width of the target", width, speed, width_cell),
        "brake": Plane("brake", brake, speed, brake_cell),
        "curve": Plane("curve", radius, speed, curve_cell),
        "height": Plane("height of a box 2 m wide", height, speed, height_cell),
    }


def check_cells(plane: Plane, world: int) -> None:
    """Raise ValueError if a value is outside the range of its scenario or environment."""
    for x, y in product(plane.x.values, plane.y.values):
        cell = plane.cell(x, y, world)
        if cell is not None:
            make_target(cell.case, {}, camera=None).close()
            if cell.texture is not None:
                CameraParams.make("wide", texture=cell.texture)
