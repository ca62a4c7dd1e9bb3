"""Models of what stands beside a road: signs, power poles, walls, hedges and houses."""

import math

from lgmd_gym.camera.render.model_builder import BODY, ModelBuilder

_FULL = (-0.5, 0.5, 0.5)
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
