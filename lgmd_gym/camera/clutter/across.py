"""What spans a road, per site on its right edge; `width` is that of the whole road."""

from collections.abc import Callable

import numpy as np

from lgmd_gym.camera.clutter.parts import mark, part
from lgmd_gym.camera.clutter.sites import Sites
from lgmd_gym.camera.objects import MODEL_BEAM, MODEL_BOX, MODEL_DECK, MODEL_PANEL, MODEL_SIGNAL
from lgmd_gym.camera.roadside import PLANT_RANGE

Parts = list[np.ndarray]
_GANTRY_FREE = 5.5  # free height below panels [m]


def bridges(s: Sites, rng: np.random.Generator) -> Parts:
    """Return bridges with a deck of 6 to 14 m along the road, on abutments or piers."""
    n = len(s.place)
    return _covered(s, rng.uniform(6.0, 14.0, n), np.where(rng.random(n) < 0.5, 0.8, 3.5), rng)


def tunnels(s: Sites, rng: np.random.Generator) -> Parts:
    """Return underpasses of 30 to 60 m."""
    n = len(s.place)
    return _covered(s, rng.uniform(30.0, 60.0, n), np.full(n, 0.8), rng)


def _covered(s: Sites, length: np.ndarray, thick: np.ndarray, rng: np.random.Generator) -> Parts:
    """Return decks on walls of a thickness, 4.7 to 5.5 m above the road."""
    n = len(s.place)
    free, gap, shade = rng.uniform(4.7, 5.5, n), rng.uniform(0.9, 1.8, n), rng.uniform(110.0, 180.0, n)
    deck = (length, s.width + 2.0 * (gap + thick), free + rng.uniform(1.4, 2.2, n))
    walls = [
        part(s, MODEL_BOX, (length, thick, free), 0.85 * shade, out=out)
        for out in (gap + 0.5 * thick, -s.width - gap - 0.5 * thick)
    ]
    return [part(s, MODEL_DECK, deck, shade, out=-0.5 * s.width, base=free), *walls]


def gantries(s: Sites, rng: np.random.Generator) -> Parts:
    """Return gantries: two legs, a beam, and one to three panels in front of it."""
    n, top = len(s.place), _GANTRY_FREE + 1.7
    shade = rng.uniform(90.0, 160.0)
    out = [part(s, MODEL_BOX, (0.35, 0.35, top), shade, out=out, along=0.3) for out in (1.4, -s.width - 1.4)]
    beam = (0.5, s.width + 2.4, top)
    out.append(part(s, MODEL_BEAM, beam, shade, out=-0.5 * s.width, along=0.3, base=top - 0.7))
    panels = np.minimum(rng.integers(1, 4, n), np.maximum(s.width // 3.6, 1.0))
    grey = rng.choice((45.0, 65.0, 205.0), n)
    for k in range(3):
        chosen = panels > k
        some = s.select(chosen)
        size = (0.1, rng.uniform(2.4, 3.3), _GANTRY_FREE + rng.uniform(2.0, 2.9))
        out.append(
            part(some, MODEL_PANEL, size, grey[chosen], out=-(k + 0.5) * some.width / panels[chosen],
                 base=_GANTRY_FREE)
        )  # fmt: skip
    return out


def signals(s: Sites, rng: np.random.Generator) -> Parts:
    """Return traffic signals: a mast with an arm over the right lane, and a head on each."""
    shade = rng.uniform(50.0, 140.0)
    return [
        part(s, MODEL_BOX, (0.18, 0.18, 6.0), shade, out=1.1),
        part(s, MODEL_BEAM, (0.14, 4.0, 6.0), shade, out=-1.0, base=5.85),
        part(s, MODEL_SIGNAL, (0.3, 0.35, 5.8), 35.0, out=-1.6, along=-0.1, base=4.85),
        part(s, MODEL_SIGNAL, (0.3, 0.35, 3.2), 35.0, out=1.1, along=-0.3, base=2.25),
    ]


def zebras(s: Sites, rng: np.random.Generator) -> Parts:
    """Return zebra crossings: bars of 0.5 m by 3 to 4 m, every metre."""
    shade, length = rng.uniform(170.0, 220.0, len(s.place)), rng.uniform(3.0, 4.0)
    out = []
    for k in range(int(s.width.max(initial=0.0))):
        chosen = s.width > k + 0.5
        out.append(mark(s.select(chosen), (length, 0.5), shade[chosen], out=-k - 0.5, distance=PLANT_RANGE))
    return out


ACROSS: dict[str, Callable[[Sites, np.random.Generator], Parts]] = {
    "tunnel": tunnels,
    "bridge": bridges,
    "gantry": gantries,
    "signal": signals,
    "zebra": zebras,
}
"""Kinds across the road, those that must not give way first."""
