"""Models beside, over and on a road."""

import math

from lgmd_gym.camera.render.models.builder import BODY, LAMP, TAIL, UNDER, ModelBuilder, Point


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
        (-0.18, 0.72, 0.17, 1.35),
        (0.16, 0.78, 0.14, 1.2),
        (0.2, 0.5, 0.18, 0.68),
        (-0.14, 0.42, 0.16, 0.6),
        (0.0, 0.6, 0.12, 1.25),
    ):
        b.face(_blob(y, z, r, 0.8 * r, 6), value, BODY, crown)
        b.fine[-1] = 12.0


def add_crown(b: ModelBuilder) -> None:
    """Add the crown of a tree without its trunk."""
    b.model()
    b.solid()
    crown = b.face(_blob(0.0, 0.5, 0.47, 0.47, 8), 0.95)
    for y, z, r, value in (
        (-0.15, 0.62, 0.16, 1.35),
        (0.13, 0.65, 0.15, 1.2),
        (0.15, 0.40, 0.17, 0.68),
        (-0.1, 0.34, 0.16, 0.6),
    ):
        b.face(_blob(y, z, r, r, 6), value, BODY, crown)
        b.fine[-1] = 12.0


_FULL = (-0.5, 0.5, 0.5)


def add_beam(b: ModelBuilder) -> None:
    """Add a box with an underside."""
    b.model()
    b.solid()
    b.box(0.0, 1.0, _FULL, _FULL)
    b.underside()


def add_deck(b: ModelBuilder) -> None:
    """Add the deck of a bridge: girders, a light edge and a parapet on both sides."""
    b.model()
    b.solid()
    faces = b.box(0.0, 1.0, _FULL, _FULL)
    for face in faces[:2]:
        b.rect(face, (0.0, 1.0), (0.0, 0.42), 0.72, BODY)  # girders
        b.rect(face, (0.0, 1.0), (0.42, 0.56), 1.2, BODY)
        for k in range(1, 8):
            b.rect(face, (k / 8.0 - 0.002, k / 8.0 + 0.002), (0.56, 1.0), 0.7, BODY)
    below = b.underside(0.55)
    for u in (0.12, 0.37, 0.62, 0.87):
        b.rect(below, (0.0, 1.0), (u - 0.02, u + 0.02), 0.35, BODY)


def _lettering(b: ModelBuilder, face: int) -> None:
    """Add the light frame and the lines of a direction sign."""
    for u, v in (
        ((0.0, 1.0), (0.94, 1.0)),
        ((0.0, 1.0), (0.0, 0.06)),
        ((0.0, 0.03), (0.06, 0.94)),
        ((0.97, 1.0), (0.06, 0.94)),
    ):
        b.rect(face, u, v, 225.0)
    for low, right in ((0.68, 0.62), (0.44, 0.78), (0.20, 0.50)):
        b.rect(face, (0.10, right), (low, low + 0.13), 225.0)
    b.rect(face, (0.84, 0.90), (0.18, 0.80), 225.0)


def add_panel(b: ModelBuilder) -> None:
    """Add a direction sign without posts."""
    b.model()
    b.solid()
    _lettering(b, b.sheet([(-0.5, 1.0), (-0.5, 0.0), (0.5, 0.0), (0.5, 1.0)], 1.1))


def add_board(b: ModelBuilder) -> None:
    """Add a direction sign on two posts."""
    b.model()
    for y in (-0.34, 0.34):
        b.solid()
        b.sheet([(y - 0.02, 0.4), (y - 0.02, 0.0), (y + 0.02, 0.0), (y + 0.02, 0.4)], 1.5, 1.5)
    b.solid()
    _lettering(b, b.sheet([(-0.5, 1.0), (-0.5, 0.4), (0.5, 0.4), (0.5, 1.0)], 1.1))


def add_signal(b: ModelBuilder) -> None:
    """Add the head of a traffic signal at red."""
    b.model()
    b.solid()
    rear = b.box(0.0, 1.0, _FULL, _FULL)[0]
    b.underside()
    red = b.disc(rear, 0.5, 0.82, 0.36, 0.13, 240.0, rear)
    b.role[red] = LAMP
    for v in (0.5, 0.18):
        b.disc(rear, 0.5, v, 0.36, 0.13, 60.0, rear)


def add_lamp(b: ModelBuilder) -> None:
    """Add the head of a street lamp, which shines downwards and to all sides at night."""
    b.model(lamps=(0.0, 1.0))
    b.solid()
    sides = b.box(0.0, 1.0, _FULL, _FULL)[:4]
    for face in (*sides, b.underside()):
        b.role[face], b.value[face] = LAMP, 150.0


_WINDOW_FINE = 20.0  # windows appear from this height of the house on: dozens of polygons [px]
_JOINT_FINE = 8.0  # the same for the joints of a wall [px]
_LEAVES_FINE = 10.0  # the same for leaves [px]
_RIM = 0.72  # values of a traffic sign, as multiples of its shade


def add_sign(b: ModelBuilder, corners: int) -> None:
    """Add a traffic sign on a post: an octagon for a round one, a triangle, or a plate."""
    b.model()
    b.solid()
    b.sheet([(-0.04, 0.72), (-0.04, 0.0), (0.04, 0.0), (0.04, 0.72)], 0.7, 0.7)
    b.solid()
    first = math.pi / 2 + math.pi / corners if corners != 3 else math.pi / 2
    angles = [first + 2.0 * math.pi * k / corners for k in range(corners)]
    reach = 0.5 / max(abs(math.cos(a)) for a in angles)
    low, high = min(map(math.sin, angles)), max(map(math.sin, angles))

    def outline(scale: float) -> list[tuple[float, float]]:
        middle = 0.5 * (low + high)
        heights = [0.86 + 0.14 * scale * (math.sin(a) - middle) / (high - middle) for a in angles]
        return [(scale * reach * math.cos(a), z) for a, z in zip(angles, heights, strict=True)]

    face = b.sheet(outline(1.0), 0.5, _RIM if corners != 4 else 1.1)
    inner = b.face([(-0.5, y, z) for y, z in outline(0.72)], 1.25 if corners != 4 else 0.45, BODY, face)
    b.face([(-0.5, y, z) for y, z in outline(0.28)], 0.2 if corners != 4 else 1.2, BODY, inner)


def add_power_pole(b: ModelBuilder) -> None:
    """Add a wooden power pole with a cross-arm."""
    b.model()
    for outline in (
        [(-0.06, 1.0), (-0.08, 0.0), (0.08, 0.0), (0.06, 1.0)],
        [(-0.5, 0.93), (-0.5, 0.905), (0.5, 0.905), (0.5, 0.93)],
    ):
        b.solid()
        b.sheet(outline, 1.0, 1.0)


def add_wall(b: ModelBuilder) -> None:
    """Add a noise barrier: panels between posts, with a light coping."""
    b.model()
    b.solid()
    for face in b.box(0.0, 1.0, _FULL, _FULL)[2:4]:
        for k in range(9):
            joint = b.rect(
                face, (max(k / 8.0 - 0.006, 0.0), min(k / 8.0 + 0.006, 1.0)), (0.0, 0.94), 0.62, BODY
            )
            b.fine[joint] = _JOINT_FINE
        b.rect(face, (0.0, 1.0), (0.94, 1.0), 1.3, BODY)
        b.rect(face, (0.0, 1.0), (0.0, 0.10), 0.75, BODY)
        b.rect(face, (0.0, 1.0), (0.46, 0.50), 0.85, BODY)


def add_hedge(b: ModelBuilder) -> None:
    """Add a piece of hedge with uneven foliage."""
    b.model()
    b.solid()
    for face in b.box(0.0, 1.0, _FULL, (-0.49, 0.49, 0.42))[:4]:
        b.rect(face, (0.0, 1.0), (0.0, 0.16), 0.6, BODY)
        for k, value in enumerate((0.8, 1.25, 0.7, 1.15, 0.85)):
            low = 0.25 + 0.09 * ((3 * k) % 5)
            b.rect(face, (0.02 + 0.19 * k, 0.16 + 0.19 * k), (low, low + 0.3), value, BODY)


def add_thicket(b: ModelBuilder) -> None:
    """Add a piece of dense trees and bushes: four crowns above a thicket with light and dark leaves."""
    b.model()
    for k, (top, value) in enumerate(((0.94, 0.8), (1.0, 1.1), (0.9, 0.65), (0.97, 0.95))):
        b.solid()
        for way in (-1.0, 1.0):  # the side at the left, that at the right
            crown = b.face(_oval(0.24 * k - 0.36, way, (0.15, top - 0.62), 0.62), value)
            b.face(_oval(0.24 * k - 0.36 + 0.04 * way, way, (0.06, 0.10), 0.8), 1.5 * value, BODY, crown)
            b.fine[-1] = _LEAVES_FINE
    b.solid()
    faces = b.box(0.0, 0.78, _FULL, (-0.49, 0.49, 0.3))
    for face, count in zip(faces[:4], (4, 4, 10, 10), strict=True):
        for k in range(count):
            u, v = (0.31 + 0.618 * k) % 1.0, (0.2 + 0.414 * k) % 1.0
            value = (0.45, 1.6, 0.65, 1.35, 0.3)[k % 5]
            leaves = b.disc(face, 0.1 + 0.8 * u, 0.14 + 0.7 * v, 0.6 / count, 0.12, value, face)
            b.role[leaves], b.fine[leaves] = BODY, _LEAVES_FINE


def _oval(x: float, way: float, radii: tuple[float, float], z: float) -> list[tuple[float, float, float]]:
    """Return an octagon along the length; `way` is -1 for the side at the left, 1 for that at the right."""
    angles = [(k + 0.5) * math.pi / 4.0 for k in range(8)]
    return [(x + way * radii[0] * math.cos(a), 0.0, z + radii[1] * math.sin(a)) for a in angles]


def add_house(b: ModelBuilder) -> None:
    """Add a house with windows and a hipped roof."""
    b.model()
    b.solid()
    faces = b.box(0.0, 0.72, (-0.47, 0.47, 0.47), (-0.47, 0.47, 0.47))
    for face, columns in zip(faces[:4], (2, 2, 4, 4), strict=True):
        b.rect(face, (0.0, 1.0), (0.0, 0.08), 0.7, BODY)
        for row in (0.14, 0.58):
            for column in range(columns):
                left = (column + 0.28) / columns
                window = b.rect(face, (left, left + 0.44 / columns), (row, row + 0.28), 45.0)
                sky = b.rect(
                    face, (left, left + 0.44 / columns), (row + 0.17, row + 0.28), 95.0, parent=window
                )
                b.fine[window], b.fine[sky] = _WINDOW_FINE, 2.0 * _WINDOW_FINE
    b.solid()
    for face in b.box(0.72, 1.0, _FULL, (-0.32, 0.32, 0.02)):
        b.value[face] = 0.55
