"""Builders of models: solids of boxes, rectangles and discs; figures of limbs and wheels."""

import math
from dataclasses import dataclass, field

import numpy as np

BODY = 0  # value: multiple of the object's shade, in the light of the face
FIXED = 1  # value: grey level, in the light of the face
TAIL = 2  # value: grey level of a tail light when off; 255 when braking
LAMP = 3  # value: grey level of a headlight by day; 255 at night
UNDER = 4  # gap below a vehicle; value: grey level in the laboratory, in numbered worlds that of shaded road

Point = tuple[float, float, float]


class ModelBuilder:
    """Lists of polygons, solids and models that grow with each call.

    A model is a list of convex *solids* that are drawn in turn (body, then cabin). A solid has faces. A face
    has details inside it with another grey: window, light, number plate, wheel. Coordinates are fractions of
    length and width (both from the centre) and of height.
    """

    def __init__(self) -> None:
        self.corners: list[list[Point]] = []
        self.parent: list[int] = []
        self.role: list[int] = []
        self.value: list[float] = []
        self.fine: list[float] = []
        self.solids: list[list[int]] = []
        self.models: list[list[int]] = []
        self.splits: list[float] = []
        self.lamps: list[tuple[float, float]] = []

    def model(self, split: float = 0.0, lamps: tuple[float, float] = (0.0, 0.0)) -> None:
        """Start a model.

        Args:
            split: Height at which the second solid begins; from below it, the solids are drawn in reverse.
            lamps: Distance of the headlights from the middle and their height; (0, 0) for none, and (0, 1)
                for one lamp that shines in all directions.
        """
        self.models.append([len(self.solids), len(self.solids)])
        self.splits.append(split)
        self.lamps.append(lamps)

    def solid(self) -> None:
        """Start a solid of the current model."""
        self.solids.append([len(self.corners), len(self.corners)])
        self.models[-1][1] = len(self.solids)

    def face(self, corners: list[Point], value: float = 1.0, role: int = BODY, parent: int = -1) -> int:
        """Add a face or detail and return its index; corners anticlockwise from outside, top left first."""
        self.corners.append(corners)
        tall = max(point[2] for point in corners) - min(point[2] for point in corners)
        # A detail fades in between heights of 0.7 px and 1.4 px.
        self.fine.append(0.0 if parent < 0 else min(0.7 / max(tall, 1e-3), 20.0))
        self.parent.append(parent)
        self.role.append(role)
        self.value.append(value)
        self.solids[-1][1] = len(self.corners)
        return len(self.corners) - 1

    def on(self, face: int, u: float, v: float) -> Point:
        """Return the point of a face at fraction u from the left and v from the bottom."""
        tl, bl, br, tr = self.corners[face]

        def mix(k: int) -> float:
            low, high = bl[k] + u * (br[k] - bl[k]), tl[k] + u * (tr[k] - tl[k])
            return low + v * (high - low)

        return mix(0), mix(1), mix(2)

    def rect(
        self,
        face: int,
        u: tuple[float, float],
        v: tuple[float, float],
        value: float,
        role: int = FIXED,
        parent: int | None = None,
    ) -> int:
        """Add a rectangle inside a face."""
        points = [self.on(face, a, b) for a, b in ((u[0], v[1]), (u[0], v[0]), (u[1], v[0]), (u[1], v[1]))]
        return self.face(points, value, role, face if parent is None else parent)

    def disc(self, face: int, u: float, v: float, ru: float, rv: float, value: float, parent: int) -> int:
        """Add an octagon inside a face."""
        angles = [math.pi / 8 + k * math.pi / 4 for k in range(8)]
        points = [self.on(face, u + ru * math.cos(a), v + rv * math.sin(a)) for a in angles]
        return self.face(points, value, FIXED, parent)

    def box(self, z0: float, z1: float, bottom: tuple[float, ...], top: tuple[float, ...]) -> list[int]:
        """Add a (tapered) box; `bottom` and `top` are (x0, x1, half width).

        Returns:
            Indices of its faces: rear, front, left, right, roof.
        """
        (a0, a1, aw), (b0, b1, bw) = bottom, top
        return [
            self.face([(b0, -bw, z1), (a0, -aw, z0), (a0, aw, z0), (b0, bw, z1)]),
            self.face([(b1, bw, z1), (a1, aw, z0), (a1, -aw, z0), (b1, -bw, z1)]),
            self.face([(b1, -bw, z1), (a1, -aw, z0), (a0, -aw, z0), (b0, -bw, z1)]),
            self.face([(b0, bw, z1), (a0, aw, z0), (a1, aw, z0), (b1, bw, z1)]),
            self.face([(b1, -bw, z1), (b0, -bw, z1), (b0, bw, z1), (b1, bw, z1)]),
        ]

    def underside(self, value: float = 0.5) -> int:
        """Add the lower face of a box of full length and width at its base."""
        corners = [(0.5, 0.5, 0.0), (-0.5, 0.5, 0.0), (-0.5, -0.5, 0.0), (0.5, -0.5, 0.0)]
        return self.face(corners, value)

    def sheet(self, outline: list[tuple[float, float]], back: float, value: float = 1.0) -> int:
        """Add an upright sheet across the length, with a plain back, and return the face to the rear.

        Args:
            outline: Corners (y, z), anticlockwise as seen from the rear, top left first.
            back: Value of the side that faces forwards.
            value: Value of the side that faces to the rear.
        """
        self.face([(0.5, y, z) for y, z in reversed(outline)], back)
        return self.face([(-0.5, y, z) for y, z in outline], value)


LIMB, WHEEL = 0, 1  # shapes of parts
REFLECTOR = 5  # returns the light of the own headlights; value: grey level by day
DAY_LAMP = 6  # a lamp that is on by day and at night, 255
HIP, KNEE, ANKLE, TOE, LEG = 0, 1, 2, 3, 4  # joints of the left leg; those of the right leg follow by LEG
SHOULDER, ELBOW, HAND, ARM = 8, 9, 10, 3  # joints of the left arm; those of the right arm follow by ARM
PEDAL, CRANK, REAR_AXLE, FRONT_AXLE = 14, 16, 17, 18  # PEDAL is the left one, the right one follows
SPOKE = 19  # reflectors: two of the rear wheel, then two of the front wheel
_FIRST_FREE = 23
MAX_JOINTS, MAX_PARTS = 56, 48
_LENGTHWISE = 0.5  # weight of the place along the length in the order of drawing

PART = np.dtype(
    [
        *((name, np.int64) for name in ("shape", "a", "b", "role")),
        *((name, np.float64) for name in ("deep_a", "wide_a", "deep_b", "wide_b", "cap")),
        *((name, np.float64) for name in ("hole", "spokes", "value", "fine", "facing", "abeam")),
    ]
)
"""A part of a figure: shape; joints at its ends (a wheel has one); role and value as those of a face; radii
at both ends as seen from the side and from behind, and reach of the round ends beyond the joints [m]; radius
of a wheel's hole [m] and the share of it that spokes cover; apparent height of the figure at which the part
starts to fade in; it is complete at twice that height [px]; change of its opacity with the cosine of the
azimuth of the lens, from 1 ahead to -1 behind, and opacity when the lens is abeam; (0, 1) for all directions.
A wheel has the radius `deep_a` and half the thickness `wide_a`."""

Place = tuple[float, float, float]
Facing = tuple[float, float]
ANY, AHEAD, BEHIND, HAIR = (0.0, 1.0), (1.7, 0.5), (-1.7, 0.5), (-1.7, 1.0)  # `facing` and `abeam` of parts


@dataclass
class Figure:
    """A figure that grows with each call, in nominal metres: forward, left and up from its centre."""

    size: tuple[float, float, float]  # nominal length, width and height [m]
    # joints at rest, shape (56, 3) [m]
    joints: np.ndarray = field(default_factory=lambda: np.zeros((MAX_JOINTS, 3)))
    # fields of `PART` of each part
    parts: list[tuple[float, ...]] = field(default_factory=list[tuple[float, ...]])
    # place of each part in the order of drawing: forward, left, and a rank [m]
    places: list[Place] = field(default_factory=list[Place])
    used: int = _FIRST_FREE

    def joint(self, x: float, y: float, z: float, index: int | None = None) -> int:
        """Set a joint, a new one by default, and return its index."""
        if index is None:
            index, self.used = self.used, self.used + 1
        self.joints[index] = x, y, z
        return index

    def limb(
        self,
        a: int,
        b: int,
        radii: tuple[float, float],
        value: float,
        place: Place,
        *,
        wide: tuple[float, float] | None = None,
        cap: float = 0.8,
        role: int = FIXED,
        fine: float = 0.0,
        seen: Facing = ANY,
    ) -> None:
        """Add a limb.

        Args:
            a: Joint at its first end.
            b: Joint at its second end.
            radii: Radii at both ends as seen from the side [m].
            value: Multiple of the shade, or a grey level.
            place: Place in the order of drawing: forward, left, and a rank that is added [m].
            wide: Radii as seen from behind; by default the same [m].
            cap: Reach of the round ends beyond the joints, as a multiple of the smaller radius.
            role: Role as that of a face.
            fine: Apparent height of the figure at which the limb starts to fade in [px].
            seen: Directions that it is drawn in: ANY, AHEAD, BEHIND or HAIR.
        """
        wide = radii if wide is None else wide
        reach = cap * min(*radii, *wide)
        self.parts.append(
            (LIMB, a, b, role, radii[0], wide[0], radii[1], wide[1], reach, 0.0, 0.0, value, fine, *seen)
        )
        self.places.append(place)

    def dot(
        self,
        joint: int,
        radius: float,
        value: float,
        place: Place,
        role: int = FIXED,
        fine: float = 0.0,
        seen: Facing = ANY,
    ) -> None:
        """Add a round part around a joint."""
        self.limb(joint, joint, (radius, radius), value, place, role=role, fine=fine, cap=1.0, seen=seen)

    def wheel(
        self, joint: int, sizes: tuple[float, float, float], value: float, spokes: float, place: Place
    ) -> None:
        """Add a wheel: radius, half its thickness and radius of its hole [m], grey level, share of spokes."""
        radius, half, hole = sizes
        self.parts.append(
            (WHEEL, joint, joint, FIXED, radius, half, radius, half, 0.0, hole, spokes, value, 0.0, *ANY)
        )
        self.places.append(place)

    def orders(self) -> np.ndarray:
        """Return the parts from far to near for four directions of the lens, shape (4, parts).

        The lens is ahead on the left, behind on the left, ahead on the right, behind on the right. Parts that
        change places as the lens passes abeam or behind the figure are beside each other in the view then.
        """
        rows: list[np.ndarray] = []
        for way, side in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
            near = [_LENGTHWISE * way * x + side * y + rank for x, y, rank in self.places]
            rows.append(np.argsort(near, kind="stable"))
        return np.array(rows, dtype=np.int64)
