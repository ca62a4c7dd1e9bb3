"""The models of everything but cars: trucks, boxes, barriers, guard rails, posts and trees."""

import math

from lgmd_gym.camera.render.model_builder import BODY, LAMP, TAIL, UNDER, ModelBuilder, Point


def add_truck(b: ModelBuilder) -> None:
    """Add a truck."""
    b.model(lamps=(0.375, 0.22))
    b.solid()
    rear, front, left, right, _ = b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    gap = b.rect(rear, (0.0, 1.0), (0.0, 0.20), 14.0, UNDER)
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


def add_plain_box(b: ModelBuilder) -> None:
    """Add a box without details."""
    b.model()
    b.solid()
    b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))


def add_barrier(b: ModelBuilder) -> None:
    """Add a striped barrier."""
    b.model()
    b.solid()
    for face in b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))[:4]:
        for u in (0.0, 0.4, 0.8):
            b.rect(face, (u, u + 0.2), (0.45, 0.95), 30.0)
        b.rect(face, (0.0, 1.0), (0.0, 0.12), 25.0)


def add_rail(b: ModelBuilder) -> None:
    """Add 8 m of guard rail: two posts and a beam with two waves."""
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


def add_post(b: ModelBuilder) -> None:
    """Add a roadside post."""
    b.model()
    b.solid()
    stick = b.face([(0.0, -0.5, 1.0), (0.0, -0.5, 0.0), (0.0, 0.5, 0.0), (0.0, 0.5, 1.0)])
    b.rect(stick, (0.0, 1.0), (0.70, 0.90), 25.0)


def _blob(y: float, z: float, ry: float, rz: float, corners: int) -> list[Point]:
    """Return an irregular round shape across the view, centred on (y, z)."""
    wobble = (1.0, 0.86, 1.05, 0.9, 0.97, 0.84, 1.08, 0.92)
    angles = [(k + 0.5) * 2.0 * math.pi / corners for k in range(corners)]
    return [
        (0.0, y + ry * wobble[k] * math.cos(a), z + rz * wobble[k] * math.sin(a))
        for k, a in enumerate(angles)
    ]


def add_tree(b: ModelBuilder) -> None:
    """Add a tree or bush."""
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


def add_crown(b: ModelBuilder) -> None:
    """Add the crown of a tree without its trunk."""
    b.model()
    b.solid()
    crown = b.face(_blob(0.0, 0.5, 0.47, 0.47, 8), 0.95)
    for y, z, r, value in (
        (-0.15, 0.62, 0.16, 1.35), (0.13, 0.65, 0.15, 1.2), (0.15, 0.40, 0.17, 0.68), (-0.1, 0.34, 0.16, 0.6),
    ):  # fmt: skip
        b.face(_blob(y, z, r, r, 6), value, BODY, crown)
        b.fine[-1] = 12.0
