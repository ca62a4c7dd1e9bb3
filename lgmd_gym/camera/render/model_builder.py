"""Builder of vehicle models from boxes, rectangles and discs."""

import math

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
