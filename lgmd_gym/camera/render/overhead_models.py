"""Models of what hangs over a road: beams, bridge decks, panels and signal heads."""

from lgmd_gym.camera.render.model_builder import BODY, LAMP, ModelBuilder

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
    for u, v in (((0.0, 1.0), (0.94, 1.0)), ((0.0, 1.0), (0.0, 0.06)), ((0.0, 0.03), (0.06, 0.94)),
                 ((0.97, 1.0), (0.06, 0.94))):  # fmt: skip
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
