"""The band of the ground between the lower and the upper side of a frame, and what is outside it.

A narrow field below the horizon contains a few metres of road, and most objects of a roadside are beyond it.
What these kernels exclude would add nothing to the frame, so that frames are the same to the bit.
"""

import math

from lgmd_gym.camera.pose import half_frame
from lgmd_gym.kernels import kernel

_MARGIN_M = 0.2  # of the height of an object
_MARGIN = 1.1  # factor on the height


@kernel
def ground_band(lens):
    """Return least and greatest distance ahead of the ground in the frame [m]; infinite above the horizon.

    The frame is the upright rectangle around the rolled one.
    """
    t = half_frame(lens)[1] / lens.focal
    upper, lower = lens.sin_pitch + t * lens.cos_pitch, t * lens.cos_pitch - lens.sin_pitch
    near = lens.z * (lens.cos_pitch + t * lens.sin_pitch) / lower if lower > 1e-9 else math.inf
    far = lens.z * (lens.cos_pitch - t * lens.sin_pitch) / -upper if upper < -1e-9 else math.inf
    return near, far


@kernel
def outside_band(lens, ahead, radius):
    """Return whether a circle on the ground, its centre at a distance ahead [m], is outside the frame."""
    near, far = ground_band(lens)
    return ahead + radius < near or ahead - radius > far


@kernel
def above_or_below(lens, obj):
    """Return whether an object on the ground is entirely above or below the frame, with its soft shadow."""
    ahead = (obj.x - lens.x) * lens.cos_yaw + (obj.y - lens.y) * lens.sin_yaw
    # With its shadow, see `order.visible`.
    radius = 0.5 * math.sqrt(obj.length**2 + obj.width**2) + 0.4 + 0.1 * obj.height
    if ahead - radius > ground_band(lens)[1]:
        return True
    # The plane through the lens and the lower side of the frame, at the highest and farthest point.
    t = half_frame(lens)[1] / lens.focal
    lower = t * lens.cos_pitch - lens.sin_pitch
    top = _MARGIN * obj.height + _MARGIN_M
    farthest = ahead + radius if lower > 0.0 else ahead - radius
    return (lens.z - top) * (lens.cos_pitch + t * lens.sin_pitch) - lower * farthest > 0.0
