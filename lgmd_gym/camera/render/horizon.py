"""The horizon in the image: a straight line, tilted by the roll of the lens."""

from typing import NamedTuple

from lgmd_gym.kernels import kernel


class Horizon(NamedTuple):
    """Row coordinates of the horizon [px].

    Attributes:
        left: At the left side of the frame.
        slope: Change per column.
        top: At the side where it is higher in the image.
        bottom: At the other side.
    """

    left: float
    slope: float
    top: float
    bottom: float


@kernel
def horizon_of(lens):
    """Return the `Horizon` of a lens."""
    middle = lens.centre_v + lens.focal * lens.sin_pitch / lens.cos_pitch / lens.cos_roll
    slope = -lens.sin_roll / lens.cos_roll
    rise = abs(slope) * lens.centre_u
    return Horizon(middle - slope * lens.centre_u, slope, middle - rise, middle + rise)
