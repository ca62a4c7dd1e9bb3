"""The bodies of cars, trucks and boxes as tables of polygons.

A model is a list of convex *solids* drawn one over the other (body, then cabin). A solid has faces;
a face has details that lie inside it and say how its grey differs there: window, light, number
plate, wheel. Coordinates are fractions of length, width (both from the centre) and height.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

MAX_CORNERS = 8
# What the grey of a polygon is made of; `value` is then ...
BODY = 0  # a multiple of the vehicle's shade, in the light of the face
FIXED = 1  # a grey of its own, in the light of the face
TAIL = 2  # a tail light: its grey when off, 255 when braking
LAMP = 3  # a headlight: its grey by day, 255 by night

_Point = tuple[float, float, float]


class Model(NamedTuple):
    """Polygons of all models.

    Attributes:
        corners: float64, shape (polygons, 8, 3), in turn, anticlockwise from outside.
        corners_used: Corners in use, int64, shape (polygons,).
        parent: The face a detail lies in, -1 for a face, int64, shape (polygons,).
        role: BODY, FIXED, TAIL or LAMP, int64, shape (polygons,).
        value: See the roles, float64, shape (polygons,).
        fine: Apparent height of the vehicle below which a detail is left out; it fades in up to
            twice that, float64, shape (polygons,) [px].
        solids: First and last + 1 polygon of each solid, int64, shape (solids, 2).
        models: First and last + 1 solid of each model, int64, shape (models, 2).
    """

    corners: np.ndarray
    corners_used: np.ndarray
    parent: np.ndarray
    role: np.ndarray
    value: np.ndarray
    fine: np.ndarray
    solids: np.ndarray
    models: np.ndarray


class _Builder:
    def __init__(self) -> None:
        self.corners: list[list[_Point]] = []
        self.parent: list[int] = []
        self.role: list[int] = []
        self.value: list[float] = []
        self.fine: list[float] = []
        self.solids: list[list[int]] = []
        self.models: list[list[int]] = []

    def model(self) -> None:
        self.models.append([len(self.solids), len(self.solids)])

    def solid(self) -> None:
        self.solids.append([len(self.corners), len(self.corners)])
        self.models[-1][1] = len(self.solids)

    def face(self, corners: list[_Point], value: float = 1.0, role: int = BODY, parent: int = -1) -> int:
        """Add a face with corners top left, bottom left, bottom right, top right, seen from outside."""
        self.corners.append(corners)
        tall = max(point[2] for point in corners) - min(point[2] for point in corners)
        # A detail appears when it is 0.7 px high and is all there at 1.4 px.
        self.fine.append(0.0 if parent < 0 else min(0.7 / max(tall, 1e-3), 20.0))
        self.parent.append(parent)
        self.role.append(role)
        self.value.append(value)
        self.solids[-1][1] = len(self.corners)
        return len(self.corners) - 1

    def on(self, face: int, u: float, v: float) -> _Point:
        """Point of a face at fraction u from the left and v from the bottom."""
        tl, bl, br, tr = self.corners[face]

        def mix(k: int) -> float:
            low, high = bl[k] + u * (br[k] - bl[k]), tl[k] + u * (tr[k] - tl[k])
            return low + v * (high - low)

        return mix(0), mix(1), mix(2)

    def rect(
        self,
        face: int,
        u: tuple[float, float],
        v: tuple[float, float],
        value: float,
        role: int = FIXED,
        parent: int | None = None,
    ) -> int:
        """Add a rectangle inside a face."""
        points = [self.on(face, a, b) for a, b in ((u[0], v[1]), (u[0], v[0]), (u[1], v[0]), (u[1], v[1]))]
        return self.face(points, value, role, face if parent is None else parent)

    def disc(self, face: int, u: float, v: float, ru: float, rv: float, value: float, parent: int) -> int:
        """Add an octagon inside a face."""
        angles = [math.pi / 8 + k * math.pi / 4 for k in range(8)]
        points = [self.on(face, u + ru * math.cos(a), v + rv * math.sin(a)) for a in angles]
        return self.face(points, value, FIXED, parent)

    def box(self, z0: float, z1: float, bottom: tuple[float, ...], top: tuple[float, ...]) -> list[int]:
        """Add a (tapered) box; `bottom` and `top` are (x0, x1, half width).

        Returns:
            Its faces: rear, front, left, right, roof.
        """
        (a0, a1, aw), (b0, b1, bw) = bottom, top
        return [
            self.face([(b0, -bw, z1), (a0, -aw, z0), (a0, aw, z0), (b0, bw, z1)]),
            self.face([(b1, bw, z1), (a1, aw, z0), (a1, -aw, z0), (b1, -bw, z1)]),
            self.face([(b1, -bw, z1), (a1, -aw, z0), (a0, -aw, z0), (b0, -bw, z1)]),
            self.face([(b0, bw, z1), (a0, aw, z0), (a1, aw, z0), (b1, bw, z1)]),
            self.face([(b1, -bw, z1), (b0, -bw, z1), (b0, bw, z1), (b1, bw, z1)]),
        ]


def _car_rear(b: _Builder, rear: int) -> None:
    gap = b.rect(rear, (0.0, 1.0), (0.0, 0.24), 14.0)  # the dark below the bumper
    b.rect(rear, (0.03, 0.15), (0.0, 0.24), 4.0, parent=gap)  # tyres
    b.rect(rear, (0.85, 0.97), (0.0, 0.24), 4.0, parent=gap)
    b.rect(rear, (0.0, 1.0), (0.24, 0.33), 38.0)  # plastic lip
    bumper = b.rect(rear, (0.0, 1.0), (0.33, 0.53), 0.9, BODY)
    b.rect(rear, (0.0, 1.0), (0.50, 0.53), 1.25, BODY, parent=bumper)
    b.rect(rear, (0.06, 0.16), (0.37, 0.42), 70.0, parent=bumper)  # reflectors
    b.rect(rear, (0.84, 0.94), (0.37, 0.42), 70.0, parent=bumper)
    plate = b.rect(rear, (0.36, 0.64), (0.58, 0.70), 205.0)
    for left in (0.385, 0.43, 0.485, 0.53, 0.575):
        b.rect(rear, (left, left + 0.03), (0.60, 0.68), 40.0, parent=plate)
    for u, lamp in ((0.02, 0.13), (0.80, 0.81)):
        light = b.rect(rear, (u, u + 0.18), (0.66, 0.92), 80.0, TAIL)
        b.rect(rear, (lamp, lamp + 0.06), (0.67, 0.74), 190.0, parent=light)  # reversing lamp
    _close_up_boot(b, rear)
    b.rect(rear, (0.20, 0.80), (0.93, 1.0), 1.15, BODY)  # edge of the boot lid
    b.rect(rear, (0.21, 0.79), (0.545, 0.56), 0.45, BODY)  # its lower gap


def _close_up_boot(b: _Builder, rear: int) -> None:
    """Add what only shows on a car that fills the frame, so that its growth stays visible."""
    first = len(b.corners)
    b.rect(rear, (0.24, 0.76), (0.75, 0.78), 30.0)  # handle
    b.disc(rear, 0.5, 0.85, 0.025, 0.04, 215.0, rear)  # badge
    b.rect(rear, (0.24, 0.34), (0.84, 0.88), 190.0)  # name of the model
    b.rect(rear, (0.68, 0.76), (0.60, 0.64), 60.0)  # sticker
    b.fine[first:] = [24.0] * (len(b.corners) - first)


def _close_up_glass(b: _Builder, window: int, sky: int) -> None:
    """Add heating wires, reflections, wiper and a sticker to the rear window."""
    first = len(b.corners)
    for low in (0.17, 0.25, 0.33, 0.41, 0.49):
        b.rect(window, (0.05, 0.95), (low, low + 0.012), 62.0)
    for u, wide, grey in (
        (0.02, 0.1, 104.0),
        (0.2, 0.05, 62.0),
        (0.37, 0.15, 99.0),
        (0.64, 0.06, 64.0),
        (0.8, 0.14, 112.0),
    ):
        b.rect(sky, (u, u + wide), (0.1, 0.4 + 3.0 * wide), grey)
    b.rect(window, (0.44, 0.56), (0.02, 0.05), 12.0)
    b.rect(window, (0.52, 0.80), (0.06, 0.09), 14.0)
    b.rect(window, (0.02, 0.08), (0.04, 0.14), 170.0)
    b.fine[first:] = [24.0] * (len(b.corners) - first)


def _car_front(b: _Builder, front: int) -> None:
    gap = b.rect(front, (0.0, 1.0), (0.0, 0.22), 14.0)
    b.rect(front, (0.03, 0.15), (0.0, 0.22), 4.0, parent=gap)
    b.rect(front, (0.85, 0.97), (0.0, 0.22), 4.0, parent=gap)
    grille = b.rect(front, (0.22, 0.78), (0.28, 0.58), 30.0)
    b.rect(front, (0.36, 0.64), (0.36, 0.48), 205.0, parent=grille)
    b.rect(front, (0.03, 0.22), (0.62, 0.84), 190.0, LAMP)
    b.rect(front, (0.78, 0.97), (0.62, 0.84), 190.0, LAMP)
    b.rect(front, (0.26, 0.74), (0.66, 0.82), 38.0)
    b.rect(front, (0.0, 1.0), (0.92, 1.0), 1.15, BODY)


def _car_side(b: _Builder, side: int, rear_u: float, front_u: float) -> None:
    sill = b.rect(side, (0.0, 1.0), (0.0, 0.24), 14.0)
    strip = b.rect(side, (0.0, 1.0), (0.24, 0.36), 0.75, BODY)
    b.rect(side, (0.02, 0.98), (0.76, 0.80), 1.15, BODY)
    for u in (rear_u, front_u):
        lo, hi = u - 0.075, u + 0.075
        arch = b.rect(side, (lo, hi), (0.36, 0.64), 10.0)
        b.disc(side, u, 0.44, 0.03, 0.12, 120.0, arch)
        b.rect(side, (lo, hi), (0.24, 0.36), 10.0, parent=strip)
        b.rect(side, (lo, hi), (0.0, 0.24), 5.0, parent=sill)
    b.rect(side, (0.42, 0.425), (0.38, 0.76), 0.5, BODY)
    b.rect(side, (0.64, 0.645), (0.38, 0.76), 0.5, BODY)


def _car_cabin(b: _Builder, faces: list[int]) -> None:
    rear, front, left, right, roof = faces
    window = b.rect(rear, (0.08, 0.92), (0.10, 0.86), 42.0)
    sky = b.rect(rear, (0.09, 0.91), (0.60, 0.85), 84.0, parent=window)  # the sky in the glass
    _close_up_glass(b, window, sky)
    b.rect(rear, (0.42, 0.58), (0.87, 0.93), 70.0, TAIL)
    b.rect(rear, (0.10, 0.90), (0.94, 1.0), 1.2, BODY)
    screen = b.rect(front, (0.06, 0.94), (0.06, 0.90), 50.0)
    b.rect(front, (0.08, 0.92), (0.60, 0.88), 110.0, parent=screen)
    for side in (left, right):
        for u in ((0.10, 0.36), (0.39, 0.62), (0.65, 0.90)):
            pane = b.rect(side, u, (0.10, 0.86), 40.0)
            b.rect(side, (u[0] + 0.01, u[1] - 0.01), (0.60, 0.85), 78.0, parent=pane)
    b.rect(roof, (0.06, 0.94), (0.1, 0.9), 1.05, BODY)


def _car(b: _Builder) -> None:
    b.model()
    b.solid()
    rear, front, left, right, top = b.box(0.0, 0.62, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    _car_rear(b, rear)
    _car_front(b, front)
    # Seen from its own side the rear is at the left of the right side and at the right of the left one.
    _car_side(b, left, 0.82, 0.18)
    _car_side(b, right, 0.18, 0.82)
    b.rect(top, (0.1, 0.9), (0.72, 0.98), 1.05, BODY)
    b.solid()
    _car_cabin(b, b.box(0.62, 1.0, (-0.47, 0.24, 0.47), (-0.36, 0.06, 0.38)))


def _truck(b: _Builder) -> None:
    b.model()
    b.solid()
    rear, front, left, right, _ = b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    gap = b.rect(rear, (0.0, 1.0), (0.0, 0.20), 14.0)
    b.rect(rear, (0.04, 0.2), (0.0, 0.20), 4.0, parent=gap)
    b.rect(rear, (0.8, 0.96), (0.0, 0.20), 4.0, parent=gap)
    b.rect(rear, (0.0, 1.0), (0.20, 0.27), 45.0)
    b.rect(rear, (0.02, 0.14), (0.28, 0.32), 80.0, TAIL)
    b.rect(rear, (0.86, 0.98), (0.28, 0.32), 80.0, TAIL)
    b.rect(rear, (0.495, 0.505), (0.33, 0.98), 0.5, BODY)
    for u in (0.12, 0.40, 0.60, 0.88):
        b.rect(rear, (u - 0.01, u + 0.01), (0.35, 0.96), 0.7, BODY)
    b.rect(front, (0.08, 0.92), (0.50, 0.78), 50.0)
    b.rect(front, (0.0, 1.0), (0.0, 0.12), 14.0)
    b.rect(front, (0.04, 0.2), (0.18, 0.26), 190.0, LAMP)
    b.rect(front, (0.8, 0.96), (0.18, 0.26), 190.0, LAMP)
    b.rect(front, (0.25, 0.75), (0.20, 0.42), 40.0)
    for side in (left, right):
        b.rect(side, (0.0, 1.0), (0.0, 0.22), 18.0)
        b.rect(side, (0.0, 1.0), (0.60, 0.64), 0.75, BODY)
        for u in (0.25, 0.5, 0.75):
            b.rect(side, (u - 0.003, u + 0.003), (0.23, 0.59), 0.6, BODY)


def _plain(b: _Builder) -> None:
    b.model()
    b.solid()
    b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))


def _barrier(b: _Builder) -> None:
    b.model()
    b.solid()
    for face in b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))[:4]:
        for u in (0.0, 0.4, 0.8):
            b.rect(face, (u, u + 0.2), (0.45, 0.95), 30.0)
        b.rect(face, (0.0, 1.0), (0.0, 0.12), 25.0)


def _rail(b: _Builder) -> None:
    """Add a piece of guard rail, 8 m long: two posts, and a beam of two waves."""
    b.model()
    for x in (-0.25, 0.25):
        b.solid()
        for y, way in ((-0.2, -1.0), (0.2, 1.0)):
            a, e = x + 0.007 * way, x - 0.007 * way
            b.face([(a, y, 0.6), (a, y, 0.0), (e, y, 0.0), (e, y, 0.6)], 1.05)
    b.solid()
    for y, way in ((-0.5, 0.5), (0.5, -0.5)):
        face = b.face([(way, y, 1.0), (way, y, 0.57), (-way, y, 0.57), (-way, y, 1.0)])
        for low, value in ((0.02, 0.7), (0.42, 0.62), (0.85, 1.2)):
            b.rect(face, (0.0, 1.0), (low, low + 0.13), value, BODY)


def _post(b: _Builder) -> None:
    b.model()
    b.solid()
    stick = b.face([(0.0, -0.5, 1.0), (0.0, -0.5, 0.0), (0.0, 0.5, 0.0), (0.0, 0.5, 1.0)])
    b.rect(stick, (0.0, 1.0), (0.70, 0.90), 25.0)


def _blob(y: float, z: float, ry: float, rz: float, corners: int) -> list[_Point]:
    """Irregular round shape across the view, centred on (y, z)."""
    wobble = (1.0, 0.86, 1.05, 0.9, 0.97, 0.84, 1.08, 0.92)
    angles = [(k + 0.5) * 2.0 * math.pi / corners for k in range(corners)]
    return [
        (0.0, y + ry * wobble[k] * math.cos(a), z + rz * wobble[k] * math.sin(a))
        for k, a in enumerate(angles)
    ]


def _tree(b: _Builder) -> None:
    b.model()
    b.solid()
    b.face([(0.0, -0.05, 0.3), (0.0, -0.07, 0.0), (0.0, 0.07, 0.0), (0.0, 0.05, 0.3)], 0.6)
    b.solid()
    crown = b.face(_blob(0.0, 0.6, 0.46, 0.37, 8), 0.95)
    for y, z, r, value in (
        (-0.18, 0.72, 0.17, 1.35), (0.16, 0.78, 0.14, 1.2), (0.2, 0.5, 0.18, 0.68),
        (-0.14, 0.42, 0.16, 0.6), (0.0, 0.6, 0.12, 1.25),
    ):  # fmt: skip
        b.face(_blob(y, z, r, 0.8 * r, 6), value, BODY, crown)
        b.fine[-1] = 12.0


@lru_cache(maxsize=1)
def all_models() -> Model:
    """Return the tables of all models, in the order of `scene.MODEL_…`."""
    b = _Builder()
    _car(b)
    _truck(b)
    _plain(b)
    _plain(b)  # a mark on the ground has no body; its row keeps the numbering
    _barrier(b)
    _rail(b)
    _post(b)
    _tree(b)
    count = np.array([len(points) for points in b.corners], dtype=np.int64)
    corners = np.zeros((len(b.corners), MAX_CORNERS, 3))
    for index, points in enumerate(b.corners):
        corners[index, : len(points)] = points
    parent = np.array(b.parent, dtype=np.int64)
    role = np.array(b.role, dtype=np.int64)
    value = np.array(b.value, dtype=np.float64)
    fine = np.array(b.fine, dtype=np.float64)
    return Model(corners, count, parent, role, value, fine, np.array(b.solids), np.array(b.models))
