"""Models of articulated trucks and buses: one box with details."""

from lgmd_gym.camera.render.model_builder import BODY, LAMP, TAIL, UNDER, ModelBuilder


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
