"""Builder of figures: pedestrians and riders, of round limbs and wheels between joints."""

from dataclasses import dataclass, field

import numpy as np

from lgmd_gym.camera.render.model_builder import FIXED

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
View = tuple[float, float]
ANY, AHEAD, BEHIND, HAIR = (0.0, 1.0), (1.7, 0.5), (-1.7, 0.5), (-1.7, 1.0)  # `facing` and `abeam` of parts


@dataclass
class Figure:
    """A figure that grows with each call, in nominal metres: forward, left and up from its centre.

    Attributes:
        size: Nominal length, width and height [m].
        joints: Joints at rest, shape (56, 3) [m].
        parts: Fields of `PART` of each part.
        places: Place of each part in the order of drawing: forward, left, and a rank [m].
    """

    size: tuple[float, float, float]
    joints: np.ndarray = field(default_factory=lambda: np.zeros((MAX_JOINTS, 3)))
    parts: list[tuple[float, ...]] = field(default_factory=list)
    places: list[Place] = field(default_factory=list)
    used: int = _FIRST_FREE

    def joint(self, x: float, y: float, z: float, index: int | None = None) -> int:
        """Set a joint, a new one by default, and return its index."""
        if index is None:
            index, self.used = self.used, self.used + 1
        self.joints[index] = x, y, z
        return index

    def limb(
        self, a: int, b: int, radii: tuple[float, float], value: float, place: Place,
        *, wide: tuple[float, float] | None = None, cap: float = 0.8, role: int = FIXED, fine: float = 0.0,
        seen: View = ANY,
    ) -> None:  # fmt: skip
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
        self, joint: int, radius: float, value: float, place: Place, role: int = FIXED,
        fine: float = 0.0, seen: View = ANY,
    ) -> None:  # fmt: skip
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
        rows = []
        for way, side in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
            near = [_LENGTHWISE * way * x + side * y + rank for x, y, rank in self.places]
            rows.append(np.argsort(near, kind="stable"))
        return np.array(rows, dtype=np.int64)
