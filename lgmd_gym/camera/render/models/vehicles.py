"""Models of vehicles: cars, bodies of other sizes, truck, trailer and bus."""

from typing import NamedTuple

from lgmd_gym.camera.render.models.builder import BODY, LAMP, TAIL, UNDER, ModelBuilder

BODY_TOP = 0.62
"""Height at which the cabin begins, as a share of a car's height."""


def _car_rear(b: ModelBuilder, rear: int) -> None:
    gap = b.rect(rear, (0.0, 1.0), (0.0, 0.24), 14.0, UNDER)  # gap below the bumper
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
    b.rect(rear, (0.20, 0.80), (0.93, 1.0), 1.15, BODY)  # boot lid
    b.rect(rear, (0.21, 0.79), (0.545, 0.56), 0.45, BODY)  # lower gap of the boot lid


def _close_up_boot(b: ModelBuilder, rear: int) -> None:
    """Add details that appear only on a car that fills the frame, so that its growth remains visible."""
    first = len(b.corners)
    b.rect(rear, (0.24, 0.76), (0.75, 0.78), 30.0)  # handle
    b.disc(rear, 0.5, 0.85, 0.025, 0.04, 215.0, rear)  # badge
    b.rect(rear, (0.24, 0.34), (0.84, 0.88), 190.0)  # model name
    b.rect(rear, (0.68, 0.76), (0.60, 0.64), 60.0)  # sticker
    b.fine[first:] = [24.0] * (len(b.corners) - first)


def _close_up_glass(b: ModelBuilder, window: int, sky: int) -> None:
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


def _car_front(b: ModelBuilder, front: int) -> None:
    gap = b.rect(front, (0.0, 1.0), (0.0, 0.22), 14.0, UNDER)
    b.rect(front, (0.03, 0.15), (0.0, 0.22), 4.0, parent=gap)
    b.rect(front, (0.85, 0.97), (0.0, 0.22), 4.0, parent=gap)
    grille = b.rect(front, (0.22, 0.78), (0.28, 0.58), 30.0)
    b.rect(front, (0.36, 0.64), (0.36, 0.48), 205.0, parent=grille)
    b.rect(front, (0.03, 0.22), (0.62, 0.84), 190.0, LAMP)
    b.rect(front, (0.78, 0.97), (0.62, 0.84), 190.0, LAMP)
    b.rect(front, (0.26, 0.74), (0.66, 0.82), 38.0)
    b.rect(front, (0.0, 1.0), (0.92, 1.0), 1.15, BODY)


def _car_side(b: ModelBuilder, side: int, rear_u: float, front_u: float) -> None:
    sill = b.rect(side, (0.0, 1.0), (0.0, 0.24), 14.0, UNDER)
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


def _car_cabin(b: ModelBuilder, faces: list[int]) -> None:
    rear, front, left, right, roof = faces
    window = b.rect(rear, (0.08, 0.92), (0.10, 0.86), 42.0)
    sky = b.rect(rear, (0.09, 0.91), (0.60, 0.85), 84.0, parent=window)  # reflection of the sky
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


def add_car(b: ModelBuilder) -> None:
    """Add a passenger car."""
    b.model(split=BODY_TOP, lamps=(0.375, 0.45))
    b.solid()
    rear, front, left, right, top = b.box(0.0, BODY_TOP, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    _car_rear(b, rear)
    _car_front(b, front)
    # From outside, the rear is on the left of the right side and on the right of the left side.
    _car_side(b, left, 0.82, 0.18)
    _car_side(b, right, 0.18, 0.82)
    b.rect(top, (0.1, 0.9), (0.72, 0.98), 1.05, BODY)
    b.solid()
    _car_cabin(b, b.box(BODY_TOP, 1.0, (-0.47, 0.24, 0.47), (-0.36, 0.06, 0.38)))


Range = tuple[float, float]


class BodyShape(NamedTuple):
    """Proportions of a vehicle with a body and a cabin, as shares of its length, width and height."""

    split: float  # height at which the cabin begins
    clearance: float  # height of the gap below the bumpers, as a share of the body's height
    floor: Range  # rear and front of the cabin at its foot, from the middle
    roof: Range  # rear and front of the roof, from the middle
    roof_half: float  # half of the roof's width
    tail: tuple[float, float, float]  # width and lower and upper end of a tail lamp on the rear of the body
    lamp_height: float  # height of the headlights
    rear_window: tuple[Range, ...]  # windows on the rear of the cabin, from the left
    glass: Range  # lower and upper end of the windows on the cabin
    panes: tuple[Range, ...]  # side windows, from the rear of the cabin
    axles: Range  # rear and front axle, from the rear
    wheel: float  # half of a wheel's length


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


def _gap(b: ModelBuilder, face: int, top: float, tyre: float) -> int:
    """Add the space below a body with two tyres, and return the space."""
    gap = b.rect(face, (0.0, 1.0), (0.0, top), 14.0, UNDER)
    for u in (0.04, 0.96 - tyre):
        b.rect(face, (u, u + tyre), (0.0, 0.9 * top), 4.0, parent=gap)
    return gap


def _axles(b: ModelBuilder, face: int, centres: tuple[float, ...], top: float, *, mirrored: bool) -> None:
    """Add the space below a long side with its wheels, given from the rear."""
    gap = b.rect(face, (0.0, 1.0), (0.0, top), 20.0, UNDER)
    for centre in centres:
        u = 1.0 - centre if mirrored else centre
        b.rect(face, (u - 0.033, u + 0.033), (0.0, top), 6.0, parent=gap)
        if top < 0.25:  # the wheel reaches into the body
            b.rect(face, (u - 0.04, u + 0.04), (top, 0.27), 10.0)
        hub = b.disc(face, u, 0.125, 0.016, 0.06, 90.0, gap)
        b.fine[hub] = 20.0


def _trailer_rear(b: ModelBuilder, face: int) -> None:
    gap = _gap(b, face, 0.28, 0.20)
    b.rect(face, (0.02, 0.98), (0.11, 0.145), 120.0, parent=gap)  # under-run bar
    for u in (0.03, 0.83):
        b.rect(face, (u, u + 0.14), (0.19, 0.235), 80.0, TAIL, parent=gap)
    b.rect(face, (0.40, 0.60), (0.20, 0.235), 205.0, parent=gap)  # number plate
    b.rect(face, (0.0, 1.0), (0.28, 0.30), 45.0)
    for u in (0.02, 0.965):  # frame of the doors with contour marking
        b.rect(face, (u, u + 0.015), (0.31, 0.98), 235.0)
    b.rect(face, (0.02, 0.98), (0.965, 0.98), 235.0)
    b.rect(face, (0.495, 0.505), (0.30, 0.97), 0.45, BODY)
    for u in (0.20, 0.36, 0.63, 0.79):  # rods of the locks
        b.rect(face, (u, u + 0.012), (0.32, 0.95), 0.65, BODY)
    for u in (0.05, 0.81):  # striped plates
        b.rect(face, (u, u + 0.14), (0.32, 0.37), 70.0)


def _cab_front(b: ModelBuilder, face: int) -> None:
    b.rect(face, (0.0, 1.0), (0.0, 0.08), 14.0)
    screen = b.rect(face, (0.06, 0.94), (0.46, 0.68), 46.0)
    b.rect(face, (0.08, 0.92), (0.58, 0.67), 105.0, parent=screen)
    b.rect(face, (0.14, 0.86), (0.19, 0.42), 40.0)
    for u in (0.03, 0.79):
        b.rect(face, (u, u + 0.18), (0.12, 0.18), 190.0, LAMP)
    b.rect(face, (0.0, 1.0), (0.95, 1.0), 1.2, BODY)


def add_trailer(b: ModelBuilder) -> None:
    """Add a tractor with a semi-trailer, the body above its wheels and the cab in one box."""
    b.model(lamps=(0.38, 0.15))
    b.solid()
    rear, front, left, right, _ = b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    _trailer_rear(b, rear)
    _cab_front(b, front)
    for face, mirrored in ((left, True), (right, False)):
        _axles(b, face, (0.11, 0.19, 0.27, 0.70, 0.92), 0.26, mirrored=mirrored)
        b.rect(face, (0.0, 1.0), (0.28, 0.30), 0.6, BODY)
        for pane, value in (((0.835, 0.862), 25.0), ((0.90, 0.98), 45.0)):  # gap behind the cab, window
            u = (1.0 - pane[1], 1.0 - pane[0]) if mirrored else pane
            b.rect(face, u, (0.30, 1.0) if value < 30.0 else (0.48, 0.68), value)
        u = (0.17, 1.0) if mirrored else (0.0, 0.83)
        b.rect(face, u, (0.31, 0.322), 225.0)  # contour marking
        b.rect(face, u, (0.95, 1.0), 1.12, BODY)


def add_bus(b: ModelBuilder) -> None:
    """Add a bus."""
    b.model(lamps=(0.38, 0.22))
    b.solid()
    rear, front, left, right, _ = b.box(0.0, 1.0, (-0.5, 0.5, 0.5), (-0.5, 0.5, 0.5))
    _gap(b, rear, 0.11, 0.14)
    window = b.rect(rear, (0.08, 0.92), (0.58, 0.88), 42.0)
    b.rect(rear, (0.10, 0.90), (0.74, 0.87), 84.0, parent=window)
    b.rect(rear, (0.18, 0.82), (0.20, 0.42), 0.6, BODY)  # engine
    b.rect(rear, (0.38, 0.62), (0.45, 0.50), 205.0)
    for u in (0.03, 0.87):
        b.rect(rear, (u, u + 0.10), (0.24, 0.46), 80.0, TAIL)
    b.rect(rear, (0.0, 1.0), (0.95, 1.0), 1.2, BODY)
    _gap(b, front, 0.09, 0.14)
    screen = b.rect(front, (0.04, 0.96), (0.36, 0.82), 46.0)
    b.rect(front, (0.06, 0.94), (0.62, 0.81), 105.0, parent=screen)
    b.rect(front, (0.15, 0.85), (0.85, 0.95), 25.0)
    for u in (0.03, 0.79):
        b.rect(front, (u, u + 0.18), (0.18, 0.26), 190.0, LAMP)
    for face, mirrored in ((left, True), (right, False)):
        _axles(b, face, (0.27, 0.80), 0.12, mirrored=mirrored)
        band = b.rect(face, (0.02, 0.98), (0.46, 0.84), 42.0)
        b.rect(face, (0.02, 0.98), (0.70, 0.82), 84.0, parent=band)
        for k in range(1, 7):
            b.rect(face, (k / 7.0 - 0.006, k / 7.0 + 0.006), (0.46, 0.84), 25.0, parent=band)
        b.rect(face, (0.0, 1.0), (0.92, 1.0), 1.12, BODY)
