"""Models of small cars, SUVs and vans: one construction with different proportions."""

from typing import NamedTuple

from lgmd_gym.camera.render.model_builder import BODY, LAMP, TAIL, UNDER, ModelBuilder

Range = tuple[float, float]


class BodyShape(NamedTuple):
    """Proportions of a vehicle with a body and a cabin, as shares of its length, width and height.

    Attributes:
        split: Height at which the cabin begins.
        clearance: Height of the gap below the bumpers, as a share of the body's height.
        floor: Rear and front of the cabin at its foot, from the middle.
        roof: Rear and front of the roof, from the middle.
        roof_half: Half of the roof's width.
        tail: Width and lower and upper end of a tail lamp on the rear of the body.
        lamp_height: Height of the headlights.
        rear_window: Windows on the rear of the cabin, from the left.
        glass: Lower and upper end of the windows on the cabin.
        panes: Side windows, from the rear of the cabin.
        axles: Rear and front axle, from the rear.
        wheel: Half of a wheel's length.
    """

    split: float
    clearance: float
    floor: Range
    roof: Range
    roof_half: float
    tail: tuple[float, float, float]
    lamp_height: float
    rear_window: tuple[Range, ...]
    glass: Range
    panes: tuple[Range, ...]
    axles: Range
    wheel: float


SMALL = BodyShape(
    split=0.60, clearance=0.22, floor=(-0.50, 0.29), roof=(-0.43, 0.10), roof_half=0.41,
    tail=(0.15, 0.62, 0.98), lamp_height=0.45, rear_window=((0.12, 0.88),), glass=(0.14, 0.80),
    panes=((0.12, 0.42), (0.45, 0.78)), axles=(0.16, 0.84), wheel=0.085,
)  # fmt: skip
SUV = BodyShape(
    split=0.58, clearance=0.28, floor=(-0.50, 0.27), roof=(-0.46, 0.13), roof_half=0.42,
    tail=(0.17, 0.66, 0.96), lamp_height=0.46, rear_window=((0.10, 0.90),), glass=(0.18, 0.78),
    panes=((0.07, 0.28), (0.31, 0.56), (0.59, 0.86)), axles=(0.18, 0.81), wheel=0.09,
)  # fmt: skip
VAN = BodyShape(
    split=0.52, clearance=0.20, floor=(-0.50, 0.39), roof=(-0.495, 0.26), roof_half=0.47,
    tail=(0.09, 0.42, 0.86), lamp_height=0.33, rear_window=((0.10, 0.45), (0.55, 0.90)), glass=(0.16, 0.66),
    panes=((0.80, 0.97),), axles=(0.19, 0.80), wheel=0.07,
)  # fmt: skip


def _wheels(b: ModelBuilder, face: int, top: float) -> None:
    """Add the gap below a bumper with two tyres."""
    gap = b.rect(face, (0.0, 1.0), (0.0, top), 14.0, UNDER)
    b.rect(face, (0.04, 0.17), (0.0, top), 4.0, parent=gap)
    b.rect(face, (0.83, 0.96), (0.0, top), 4.0, parent=gap)


def _rear(b: ModelBuilder, face: int, s: BodyShape) -> None:
    low = s.clearance
    _wheels(b, face, low)
    b.rect(face, (0.0, 1.0), (low, low + 0.12), 38.0)  # plastic bumper
    b.rect(face, (0.0, 1.0), (low + 0.12, low + 0.17), 1.25, BODY)  # its glossy edge
    plate = b.rect(face, (0.36, 0.64), (0.52, 0.63), 205.0)
    b.rect(face, (0.40, 0.60), (0.55, 0.60), 60.0, parent=plate)
    width, bottom, top = s.tail
    for u in (0.02, 0.98 - width):
        light = b.rect(face, (u, u + width), (bottom, top), 80.0, TAIL)
        b.rect(face, (u + 0.3 * width, u + 0.7 * width), (bottom, bottom + 0.07), 190.0, parent=light)
    b.rect(face, (0.2, 0.8), (0.94, 1.0), 1.2, BODY)


def _front(b: ModelBuilder, face: int, s: BodyShape) -> None:
    _wheels(b, face, s.clearance)
    grille = b.rect(face, (0.22, 0.78), (s.clearance + 0.06, 0.60), 30.0)
    b.rect(face, (0.37, 0.63), (0.40, 0.50), 205.0, parent=grille)
    middle = s.lamp_height / s.split
    for u in (0.03, 0.77):
        b.rect(face, (u, u + 0.2), (middle - 0.1, middle + 0.1), 190.0, LAMP)
    b.rect(face, (0.0, 1.0), (0.93, 1.0), 1.25, BODY)


def _side(b: ModelBuilder, face: int, s: BodyShape, *, mirrored: bool) -> None:
    low = s.clearance
    sill = b.rect(face, (0.0, 1.0), (0.0, low), 14.0, UNDER)
    b.rect(face, (0.02, 0.98), (0.80, 0.85), 1.2, BODY)
    for axle in s.axles:
        u = 1.0 - axle if mirrored else axle
        span = (u - s.wheel, u + s.wheel)
        arch = b.rect(face, span, (low, low + 0.42), 10.0)
        b.disc(face, u, low + 0.14, 0.4 * s.wheel, 0.13, 120.0, arch)
        b.rect(face, span, (0.0, low), 5.0, parent=sill)
    b.rect(face, (0.498, 0.502), (low + 0.1, 0.8), 0.5, BODY)  # edge of the doors


def _cabin(b: ModelBuilder, s: BodyShape) -> None:
    half = 0.47 if s.roof_half < 0.47 else s.roof_half
    rear, front, left, right, roof = b.box(s.split, 1.0, (*s.floor, half), (*s.roof, s.roof_half))
    low, high = s.glass
    glint = low + 0.55 * (high - low)
    for u in s.rear_window:
        window = b.rect(rear, u, s.glass, 42.0)
        b.rect(rear, (u[0] + 0.02, u[1] - 0.02), (glint, high - 0.02), 86.0, parent=window)
    b.rect(rear, (0.42, 0.58), (high + 0.03, high + 0.10), 70.0, TAIL)
    b.rect(rear, (0.06, 0.94), (0.93, 1.0), 1.2, BODY)
    screen = b.rect(front, (0.06, 0.94), (0.06, 0.90), 48.0)
    b.rect(front, (0.08, 0.92), (0.58, 0.88), 112.0, parent=screen)
    for face, mirrored in ((left, True), (right, False)):
        for pane in s.panes:
            u = (1.0 - pane[1], 1.0 - pane[0]) if mirrored else pane
            glass = b.rect(face, u, s.glass, 40.0)
            b.rect(face, (u[0] + 0.01, u[1] - 0.01), (glint, high - 0.02), 80.0, parent=glass)
    b.rect(roof, (0.06, 0.94), (0.08, 0.92), 1.05, BODY)


def add_body(b: ModelBuilder, s: BodyShape) -> None:
    """Add a vehicle with a body and a cabin."""
    b.model(split=s.split, lamps=(0.37, s.lamp_height))
    b.solid()
    rear, front, left, right, top = b.box(0.0, s.split, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    _rear(b, rear, s)
    _front(b, front, s)
    _side(b, left, s, mirrored=True)
    _side(b, right, s, mirrored=False)
    b.rect(top, (0.08, 0.92), (0.80, 0.98), 1.1, BODY)  # the sky on the bonnet
    b.rect(top, (0.08, 0.92), (0.95, 0.99), 1.3, BODY)
    b.solid()
    _cabin(b, s)
