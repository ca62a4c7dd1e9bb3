# pyright: standard
# Not strict: numba infers the types of the arguments of kernels.
"""The arrays that the kernels of a frame share, by name, and the horizon."""

from typing import NamedTuple

import numpy as np

from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.render.models.builder import MAX_JOINTS
from lgmd_gym.kernels import kernel

STAGES = (
    *("pose", "selection", "sky", "roads and lines", "soft shadows", "cast shadows", "ground"),
    *("vehicles", "roadside", "sensor"),
)
"""Stages of a frame, in which profiles measure time; see `clock.mark`."""
POSE, SELECTION, SKY, LINES, SOFT_SHADOWS, CAST_SHADOWS, GROUND, VEHICLES, ROADSIDE, SENSOR = (
    np.int64(1 + k) for k in range(len(STAGES))
)


class Views(NamedTuple):
    """Per-camera arrays."""

    looks: np.ndarray  # `LOOK` records, shape (cameras,)
    beams: np.ndarray  # fall-off of the low beam over the columns, float32, shape (cameras, width)
    skies: np.ndarray  # the last sky, float32, shape (cameras, height, width)
    sky_aims: np.ndarray  # yaw, pitch and roll of the last sky, float64, shape (cameras, 3)
    noise_starts: np.ndarray  # index of the frame's first number in the noise table, int64, shape (cameras,)
    exposures: np.ndarray  # state of exposure and contrast control, see `sensor`, float64, shape (cameras, 7)


class View(NamedTuple):
    """One camera, posed: a `LENS` record, and a row of `Views`."""

    lens: np.ndarray
    look: np.record
    beam: np.ndarray
    sky: np.ndarray
    sky_aim: np.ndarray
    noise_start: int
    exposure: np.ndarray


class Buffers(NamedTuple):
    """Scratch memory."""

    image: np.ndarray  # light of the last frame, float32, shape (height, width) [grey levels]
    exposure: np.ndarray  # light summed over the exposure, float32, shape (height, width)
    lens: np.ndarray  # the lens at one time of the exposure, a `LENS` record, shape (1,)
    # coverage differences of road, paint, soft shadows and shadows that the sun casts, float32, shape (4,
    # height, width + 2)
    ground: np.ndarray
    # coverage differences of a solid and of its grey, float32, shape (2, height, width + 2)
    solids: np.ndarray
    corners: np.ndarray  # corners of a polygon as (depth, right, down), float64, shape (3, 16) [m]
    uv: np.ndarray  # projected corners of a polygon, float64, shape (2, 20) [px]
    outline: np.ndarray  # x, y of up to eight corners on the ground relative to the lens, float64, (2, 8) [m]
    axes: np.ndarray  # axes of an object, see `place_object`, float64, shape (5, 3)
    greys: np.ndarray  # grey and light of the polygons of all models, float64, shape (polygons, 2)
    # joints of a figure, see `pose_figure`; then in camera axes, float64, shape (56, 3) [m]
    joints: np.ndarray
    # azimuth of the horizon in each column relative to the lens [rad] and length of its direction [px],
    # float64, shape (2, width)
    directions: np.ndarray
    clock: np.ndarray  # ticks at the last mark, then per stage, int64, shape (11,)
    outlines: np.ndarray  # skyline in each column, see `sky`, float32, shape (5, width)


class GroundLayer(NamedTuple):
    """The `Buffers` that polygons on the ground are added to, and the `FRUSTUM` of the lens."""

    coverage: np.ndarray
    corners: np.ndarray
    uv: np.ndarray
    outline: np.ndarray
    frustum: np.record


class SolidLayer(NamedTuple):
    """The `Buffers` that solids are drawn with."""

    coverage: np.ndarray
    corners: np.ndarray
    uv: np.ndarray
    axes: np.ndarray
    greys: np.ndarray
    joints: np.ndarray


def make_buffers(shape: tuple[int, int], polygons: int) -> Buffers:
    """Return buffers for frames of `(height, width)` and models with this many polygons."""
    height, width = shape
    return Buffers(
        image=np.zeros((height, width), dtype=np.float32),
        exposure=np.zeros((height, width), dtype=np.float32),
        lens=np.zeros(1, dtype=LENS),
        ground=np.zeros((4, height, width + 2), dtype=np.float32),
        solids=np.zeros((2, height, width + 2), dtype=np.float32),
        corners=np.zeros((3, 16)),
        uv=np.zeros((2, 20)),
        outline=np.zeros((2, 8)),
        axes=np.zeros((5, 3)),
        greys=np.zeros((polygons, 2)),
        joints=np.zeros((MAX_JOINTS, 3)),
        directions=np.zeros((2, width)),
        clock=np.zeros(1 + len(STAGES), dtype=np.int64),
        outlines=np.zeros((5, width), dtype=np.float32),
    )


class Horizon(NamedTuple):
    """Row coordinates of the horizon [px]."""

    left: float  # at the left side of the frame
    slope: float  # change per column
    top: float  # at the side where it is higher in the image
    bottom: float  # at the other side


@kernel
def horizon_of(lens):
    """Return the `Horizon` of a lens."""
    middle = lens.centre_v + lens.focal * lens.sin_pitch / lens.cos_pitch / lens.cos_roll
    slope = -lens.sin_roll / lens.cos_roll
    rise = abs(slope) * lens.centre_u
    left = middle - slope * lens.centre_u
    return Horizon(left=left, slope=slope, top=middle - rise, bottom=middle + rise)
