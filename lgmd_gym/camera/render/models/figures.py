"""Models of pedestrians and two-wheelers.

The boxes are those of the targets of ISO 19206-2 (adult, child), -4 and -5; the height of a two-wheeler
includes its rider. A child is the figure of the adult in its own box. Test dummies have a black shirt and
blue trousers; here the shade of the object is that of the jacket, and the other parts have their own.
The bicycle is a city bicycle with wheels of 28 inches.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.effects import WHITE
from lgmd_gym.camera.render.models.builder import (
    AHEAD,
    ANKLE,
    ANY,
    ARM,
    BEHIND,
    BODY,
    CRANK,
    DAY_LAMP,
    ELBOW,
    FRONT_AXLE,
    HAIR,
    HAND,
    HIP,
    KNEE,
    LAMP,
    LEG,
    MAX_PARTS,
    PART,
    PEDAL,
    REAR_AXLE,
    REFLECTOR,
    SHOULDER,
    SPOKE,
    TAIL,
    TOE,
    Figure,
    Place,
)

SKIN, NECK, DARK, TROUSERS, SHOES, TYRE, STEEL = 150.0, 118.0, 30.0, 42.0, 28.0, 24.0, 70.0  # grey levels
_SIDES = ((0, 1.0), (1, -1.0))  # left and right: index, sign of the lateral position


class FigureTables(NamedTuple):
    """Tables of all figures."""

    sizes: np.ndarray  # nominal length, width and height, float64, shape (figures, 3) [m]
    joints: np.ndarray  # joints at rest, float64, shape (figures, 56, 3) [m]
    parts: np.ndarray  # `PART` records, shape (figures, 48)
    counts: np.ndarray  # number of parts and of joints, int64, shape (figures, 2)
    orders: np.ndarray  # see `Figure.orders`, int64, shape (figures, 4, 48)


def _add_leg(f: Figure, index: int, y: float, thigh: tuple[float, float], value: float) -> None:
    first = LEG * index
    place = (0.0, y, 0.0)
    f.limb(first + HIP, first + KNEE, thigh, value, place)
    f.limb(first + KNEE, first + ANKLE, (thigh[1] - 0.004, 0.045), value, place)
    f.limb(first + ANKLE, first + TOE, (0.05, 0.036), SHOES, place, fine=6.0)


def _add_arm(f: Figure, index: int, place: Place, beyond: Place, hand: float = SKIN) -> None:
    """Add an arm with its places in the order of drawing, to the elbow and beyond."""
    first = SHOULDER + ARM * index
    f.limb(first, first + ELBOW - SHOULDER, (0.056, 0.046), 0.9, place, role=BODY)
    f.limb(first + 1, first + HAND - SHOULDER, (0.044, 0.036), 0.9, beyond, role=BODY)
    f.dot(first + 2, 0.041, hand, beyond, fine=10.0)


def _pedestrian() -> Figure:
    f = Figure((0.6, 0.5, 1.8))
    for index, side in _SIDES:
        leg, arm = LEG * index, SHOULDER + ARM * index
        for joint, (x, y, z) in enumerate(((0.0, 0.085, 0.92), (0.0, 0.085, 0.5), (0.0, 0.085, 0.08))):
            f.joint(x, side * y, z, leg + joint)
        f.joint(0.15, side * 0.1, 0.035, leg + TOE)
        for joint, (x, y, z) in enumerate(((0.0, 0.185, 1.43), (-0.01, 0.21, 1.13), (0.02, 0.215, 0.87))):
            f.joint(x, side * y, z, arm + joint)
        _add_leg(f, index, side * 0.085, (0.085, 0.058), TROUSERS)
        _add_arm(f, index, (0.0, side * 0.25, 0.0), (0.0, side * 0.25, 0.17))  # hands over the thighs
    low, waist, chest = f.joint(0.0, 0.0, 0.86), f.joint(0.0, 0.0, 0.95), f.joint(0.0, 0.0, 1.40)
    f.limb(low, waist, (0.1, 0.105), TROUSERS, (0.0, 0.0, 0.02), wide=(0.15, 0.155), cap=0.3)
    collar, chin, crown = f.joint(-0.01, 0.0, 1.46), f.joint(0.015, 0.0, 1.625), f.joint(0.0, 0.0, 1.70)
    f.limb(collar, chin, (0.07, 0.052), NECK, (0.0, 0.0, 0.09), wide=(0.085, 0.052))
    f.limb(waist, chest, (0.105, 0.115), 1.0, (0.0, 0.0, 0.1), wide=(0.15, 0.185), cap=0.9, role=BODY)
    _add_head(f, chin, crown, 0.12)
    return f


def _add_head(f: Figure, chin: int, crown: int, rank: float) -> None:
    """Add a face and hair, which is behind the face."""
    x, _, z = f.joints[crown]
    nape, top = f.joint(x - 0.045, 0.0, z - 0.04), f.joint(x - 0.02, 0.0, z + 0.012)
    f.limb(chin, crown, (0.082, 0.1), SKIN, (0.0, 0.0, rank), wide=(0.064, 0.08), cap=1.25)
    for seen, higher in ((ANY, -0.001), (HAIR, 0.001)):  # hair behind the face, then over its back
        f.limb(
            nape,
            top,
            (0.075, 0.088),
            DARK,
            (0.0, 0.0, rank + higher),
            wide=(0.078, 0.084),
            cap=1.0,
            fine=5.0,
            seen=seen,
        )


def _add_rider(
    f: Figure, spine: tuple[tuple[float, float], ...], head: tuple[tuple[float, float], ...], helmet: float
) -> None:
    """Add the torso between two points (x, z), and the head between two more with its helmet."""
    pelvis, chest = (f.joint(x, 0.0, z) for x, z in spine)
    chin, crown = (f.joint(x, 0.0, z) for x, z in head)
    f.limb(chest, chin, (0.09, 0.052), NECK, (0.0, 0.0, 0.11), wide=(0.1, 0.052))
    f.limb(pelvis, chest, (0.125, 0.12), 1.0, (0.0, 0.0, 0.12), wide=(0.17, 0.185), cap=0.8, role=BODY)
    if helmet:
        f.limb(chin, crown, (0.125, 0.13), helmet, (0.0, 0.0, 0.14), wide=(0.112, 0.115), cap=1.0)
        visor = f.joint(head[1][0] + 0.075, 0.0, head[1][1] - 0.02)
        f.limb(
            visor,
            visor,
            (0.06, 0.06),
            20.0,
            (0.0, 0.0, 0.15),
            wide=(0.09, 0.09),
            fine=8.0,
            seen=AHEAD,
        )
        return
    _add_head(f, chin, crown, 0.14)


def _bicycle_frame(f: Figure) -> None:
    rear, front = f.joint(-0.6, 0.0, 0.345, REAR_AXLE), f.joint(0.6, 0.0, 0.345, FRONT_AXLE)
    crank, saddle = f.joint(-0.13, 0.0, 0.29, CRANK), f.joint(-0.33, 0.0, 0.9)
    low, high, nose = f.joint(0.44, 0.0, 0.74), f.joint(0.36, 0.0, 1.0), f.joint(-0.2, 0.0, 0.94)
    back, stem = f.joint(-0.42, 0.0, 0.93), f.joint(0.33, 0.0, 1.11)
    f.wheel(rear, (0.345, 0.026, 0.302), TYRE, 0.12, (0.0, 0.0, -0.01))
    f.wheel(front, (0.345, 0.026, 0.302), TYRE, 0.12, (0.6, 0.0, -0.01))
    middle = (0.0, 0.0, 0.0)
    for a, b in ((crank, saddle), (crank, low), (crank, rear), (saddle, high), (saddle, rear)):
        f.limb(a, b, (0.022, 0.022), STEEL, middle, fine=5.0)
    f.limb(high, front, (0.024, 0.02), STEEL, (0.6, 0.0, 0.0), fine=5.0)
    f.limb(high, stem, (0.022, 0.022), STEEL, (0.3, 0.0, 0.0), fine=8.0)
    f.limb(back, nose, (0.045, 0.03), DARK, (-0.1, 0.0, 0.0), wide=(0.08, 0.03), fine=5.0)
    for _, side in _SIDES:
        grip = f.joint(0.24, side * 0.235, 1.12)
        f.limb(stem, grip, (0.018, 0.018), STEEL, (0.3, side * 0.02, 0.0), fine=5.0)


def _bicycle() -> Figure:
    f = Figure((1.89, 0.5, 1.86))
    _bicycle_frame(f)
    for index, side in _SIDES:
        leg, arm = LEG * index, SHOULDER + ARM * index
        f.joint(-0.29, side * 0.09, 1.0, leg + HIP)
        for joint in (KNEE, ANKLE, TOE):
            f.joint(0.0, side * 0.11, 0.0, leg + joint)
        pedal = f.joint(0.0, side * 0.11, 0.0, PEDAL + index)
        for joint, (x, y, z) in enumerate(((-0.07, 0.18, 1.46), (0.03, 0.21, 1.19), (0.23, 0.2, 1.14))):
            f.joint(x, side * y, z, arm + joint)
        f.limb(CRANK, pedal, (0.018, 0.018), STEEL, (0.0, side * 0.12, -0.03), fine=10.0)
        _add_leg(f, index, side * 0.1, (0.085, 0.058), TROUSERS)
        f.dot(pedal, 0.035, 130.0, (0.0, side * 0.08, 0.03), REFLECTOR, fine=3.0)
        _add_arm(f, index, (0.1, side * 0.2, 0.0), (0.9, side * 0.2, 0.0))
    for spoke in range(4):
        x = -0.6 if spoke < 2 else 0.6
        place = (max(x, 0.0), 0.0, 0.005)
        f.dot(f.joint(x, 0.0, 0.345, SPOKE + spoke), 0.035, 130.0, place, REFLECTOR, fine=3.0)
    _add_rider(f, ((-0.3, 1.02), (-0.1, 1.44)), ((0.0, 1.675), (-0.01, 1.755)), 0.0)
    f.dot(f.joint(-0.86, 0.0, 0.72), 0.04, 90.0, (0.0, 0.0, 0.15), TAIL, fine=2.0, seen=BEHIND)
    f.dot(f.joint(-0.87, 0.0, 0.64), 0.04, 90.0, (0.0, 0.0, 0.15), REFLECTOR, fine=2.0, seen=BEHIND)
    f.limb(
        f.joint(-0.6, 0.0, 0.72), f.joint(-0.84, 0.0, 0.70), (0.02, 0.02), STEEL, (0.0, 0.0, 0.0), fine=10.0
    )
    f.dot(f.joint(0.46, 0.0, 0.95), 0.04, 190.0, (0.0, 0.0, 0.15), LAMP, fine=2.0, seen=AHEAD)
    return f


def _motorcycle_body(f: Figure) -> None:
    rear, front = f.joint(-0.73, 0.0, 0.31, REAR_AXLE), f.joint(0.73, 0.0, 0.31, FRONT_AXLE)
    f.wheel(rear, (0.31, 0.085, 0.2), TYRE, 0.5, (0.0, 0.0, -0.01))
    f.wheel(front, (0.31, 0.06, 0.2), TYRE, 0.5, (0.5, 0.0, -0.01))
    spots = {
        "swing": (-0.05, 0.36), "engine": (0.0, 0.42), "radiator": (0.25, 0.46), "tank": (0.04, 0.82),
        "yoke": (0.34, 0.86), "seat": (-0.05, 0.76), "pillion": (-0.48, 0.83), "tail": (-0.84, 0.92),
        "screen": (0.50, 1.05), "nose": (0.6, 0.82), "guard": (-0.8, 0.62), "bar": (0.4, 1.0),
    }  # fmt: skip
    at = {name: f.joint(x, 0.0, z) for name, (x, z) in spots.items()}
    f.limb(at["swing"], rear, (0.05, 0.04), STEEL, (0.0, 0.0, 0.0), wide=(0.1, 0.11), fine=5.0)
    f.limb(at["engine"], at["radiator"], (0.19, 0.17), 48.0, (0.0, 0.0, 0.0), wide=(0.13, 0.12))
    f.limb(at["tank"], at["yoke"], (0.13, 0.1), 1.3, (0.0, 0.0, 0.04), wide=(0.14, 0.11), role=BODY)
    f.limb(at["pillion"], at["seat"], (0.07, 0.08), 22.0, (0.0, 0.0, -0.05), wide=(0.12, 0.13))
    f.limb(at["pillion"], at["tail"], (0.07, 0.035), 1.3, (-0.24, 0.0, 0.08), wide=(0.12, 0.07), role=BODY)
    f.limb(at["tail"], at["guard"], (0.025, 0.02), 30.0, (-0.24, 0.0, 0.085), wide=(0.06, 0.08))
    f.limb(at["yoke"], front, (0.045, 0.04), STEEL, (0.5, 0.0, 0.0), wide=(0.1, 0.1))
    f.limb(at["nose"], at["screen"], (0.12, 0.05), 1.3, (0.5, 0.0, 0.02), wide=(0.17, 0.11), role=BODY)
    for _, side in _SIDES:
        grip, mirror = f.joint(0.33, side * 0.36, 1.03), f.joint(0.36, side * 0.34, 1.14)
        f.limb(at["bar"], grip, (0.022, 0.022), DARK, (0.36, side * 0.02, 0.0), fine=5.0)
        f.limb(mirror, mirror, (0.03, 0.03), DARK, (0.36, side * 0.2, 0.0), wide=(0.05, 0.05), fine=6.0)
    silencer = f.joint(-0.32, -0.17, 0.4), f.joint(-0.72, -0.2, 0.48)
    f.limb(*silencer, (0.05, 0.065), 105.0, (-0.2, -0.15, 0.0), fine=5.0)
    plate = at["guard"], f.joint(-0.83, 0.0, 0.68)
    f.limb(*plate, (0.02, 0.02), 200.0, (-0.24, 0.0, 0.09), wide=(0.09, 0.09), fine=5.0, seen=BEHIND)
    f.dot(f.joint(-0.89, 0.0, 0.86), 0.055, 80.0, (-0.24, 0.0, 0.095), TAIL, seen=BEHIND)
    f.dot(f.joint(-0.87, 0.0, 0.77), 0.03, 90.0, (-0.24, 0.0, 0.095), REFLECTOR, fine=2.0, seen=BEHIND)
    f.dot(f.joint(0.69, 0.0, 0.86), 0.085, 255.0, (0.5, 0.0, 0.03), DAY_LAMP, seen=AHEAD)


def _motorcycle() -> Figure:
    f = Figure((2.08, 0.79, 1.45))
    _motorcycle_body(f)
    leg_places = ((-0.26, 0.1, 0.85), (0.13, 0.21, 0.7), (-0.19, 0.195, 0.36), (-0.02, 0.2, 0.29))
    arm_places = ((0.02, 0.19, 1.15), (0.14, 0.32, 0.98), (0.34, 0.32, 1.02))
    for index, side in _SIDES:
        for joint, (x, y, z) in enumerate(leg_places):
            f.joint(x, side * y, z, LEG * index + joint)
        for joint, (x, y, z) in enumerate(arm_places):
            f.joint(x, side * y, z, SHOULDER + ARM * index + joint)
        _add_leg(f, index, side * 0.19, (0.095, 0.068), TROUSERS)
        _add_arm(f, index, (0.15, side * 0.3, 0.0), (0.15, side * 0.3, 0.0), SHOES)
    _add_rider(f, ((-0.28, 0.9), (0.0, 1.14)), ((0.12, 1.3), (0.12, 1.325)), 110.0)
    return f


@lru_cache(maxsize=2)
def figure_tables(linear: bool) -> FigureTables:
    """Return the tables of all figures, in the order of their models; see `all_models`."""
    figures = (_pedestrian(), _bicycle(), _motorcycle())
    parts, orders = (
        np.zeros((len(figures), MAX_PARTS), PART),
        np.zeros((len(figures), 4, MAX_PARTS), np.int64),
    )
    for k, figure in enumerate(figures):
        count = len(figure.parts)
        parts[k, :count], orders[k, :, :count] = figure.parts, figure.orders()
    if linear:
        parts["value"] *= parts["value"] / np.where(parts["role"] == BODY, 1.0, WHITE)
    return FigureTables(
        sizes=np.array([figure.size for figure in figures]),
        joints=np.array([figure.joints for figure in figures]),
        parts=parts,
        counts=np.array([(len(figure.parts), figure.used) for figure in figures], dtype=np.int64),
        orders=orders,
    )
