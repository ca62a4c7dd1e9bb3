"""The model of a passenger car."""

from lgmd_gym.camera.render.model_builder import BODY, LAMP, TAIL, UNDER, ModelBuilder

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
