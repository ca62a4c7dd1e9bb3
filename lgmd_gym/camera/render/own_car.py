"""The own car in front of the lens: the bonnet.

The height of the bonnet falls as a parabola from the base of the windscreen to the front, and from its middle
to its sides. A ray with the tangent t to the right, which falls by d per metre ahead of the lens, meets it at
the distance X where

    A / X + B X = D, with D = d + 2 k x₀ + 2 c l t, A = a + k x₀² + c l² and B = k + c t²,

for a lens that is a above the base of the windscreen, x₀ behind it and l left of the centreline, in axes of
the car. The least D on the bonnet is its upper edge in the image. The root of D² - 4 A B is the tangent of
the angle between ray and surface, which determines the share of the sky that is reflected (by Schlick).

Approximations: the reflected light is that of the sky at the horizon, and the own headlights do not light the
bonnet. Below the base of the windscreen the frame is dark.
"""

import math

import numba as nb
import numpy as np

from lgmd_gym.camera.effects import to_light
from lgmd_gym.camera.objects import index_shade
from lgmd_gym.camera.params import CameraParams
from lgmd_gym.camera.pose import height_of, seed_of
from lgmd_gym.camera.worlds import draw_world
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import (
    LANES,
    any_above,
    as_floats,
    lane_numbers,
    load_part,
    madd,
    magnitude,
    maximum,
    minimum,
    select_by_sign,
    splat,
    square_root,
    store_part,
)

OWN_CAR = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("bonnet", "above", "behind", "left", "front"),
            *("paint", "sky", "inside", "reflected", "yaw", "pitch"),
        )
    ]
)
"""The own car in front of a lens, as the kernels read it.

1.0 if the bonnet is drawn; height of the lens above the base of the windscreen, its distance behind the base,
left of the centreline and behind the front [m]; light of the bonnet, of the sky that it reflects, of the dark
part below, and of the reflections in the windscreen, see `add_reflections`; yaw and pitch of the lens
relative to the car, which `pose_on_car` writes [rad].
"""
_BASE_HEIGHT, _FRONT_HEIGHT = 0.95, 0.75  # of the bonnet above the ground [m]
_LENGTH, _HALF_WIDTH = 1.0, 0.8  # of the bonnet, which ends at the front bumper [m]
_FALL = (_BASE_HEIGHT - _FRONT_HEIGHT) / _LENGTH**2  # k [1/m]
_CAMBER = 0.1 / _HALF_WIDTH**2  # c: the bonnet's sides are 0.1 m lower than its middle [1/m]
_INSIDE_GREY = 24.0


def own_car_of(p: CameraParams, look: np.ndarray) -> np.ndarray:
    """Return the `OWN_CAR` record of a camera, shape ().

    Args:
        p: Parameters of the camera.
        look: Its `LOOK` record.
    """
    own, outside = np.zeros((), OWN_CAR), look["night_light"] if p.light == "night" else 1.0
    own["bonnet"], own["left"] = float(p.bonnet), p.mount_left
    own["above"] = height_of(p, draw_world(p.world)) - _BASE_HEIGHT
    own["behind"], own["front"] = p.mount_setback - _LENGTH, p.mount_setback
    # The grey that a camera of another car draws the first vehicle of the road with.
    own["paint"] = outside * to_light(p, index_shade(seed_of(p), 0))
    own["sky"], own["inside"] = look["horizon"], outside * to_light(p, _INSIDE_GREY)
    own["reflected"] = p.windscreen * look["zenith"]
    return own


@kernel
def draw_bonnet(image, lens, own):
    """Draw the bonnet over the lower rows of an image."""
    yaw, pitch = (math.cos(own.yaw), math.sin(own.yaw)), (math.cos(own.pitch), math.sin(own.pitch))
    for k in range(image.shape[0]):
        # Rows above one without a bonnet have none.
        if not _draw_row(image, image.shape[0] - 1 - k, lens, own, yaw, pitch):
            return


@kernel
def _clamped(share):
    return minimum(maximum(share, splat(nb.float32(0.0))), splat(nb.float32(1.0)))


@kernel
def _draw_row(image, row, lens, own, yaw, pitch):
    """Draw the bonnet over one row; returns whether the row has a part of it.

    `yaw` and `pitch` are the cosine and sine of the lens's angles relative to the car.
    """
    width, drawn = image.shape[1], False
    v = row + 0.5 - lens.centre_v
    level, down = lens.focal * pitch[0] + v * pitch[1], v * pitch[0] - lens.focal * pitch[1]
    falls = splat(nb.float32(down))
    right = as_floats(lane_numbers()) + splat(nb.float32(0.5 - lens.centre_u))
    cos, sin, step = splat(nb.float32(yaw[0])), splat(nb.float32(yaw[1])), splat(nb.float32(LANES))
    none = splat(nb.float32(0.0))
    for j in range(0, width, LANES):
        ahead = splat(nb.float32(level * yaw[0])) - right * sin
        cover, light = _bonnet(own, ahead, madd(right, cos, splat(nb.float32(level * yaw[1]))), falls)
        right = right + step
        if any_above(cover, none):
            drawn = True
            at, count = row * width + j, width - j
            behind = load_part(image, at, count)
            store_part(image, at, count, madd(cover, light - behind, behind))
    return drawn


@kernel
def _bonnet(own, ahead, across, down):
    """Return the share of sixteen pixels that shows the own car, and its light.

    The rays are in axes of the car, scaled so that a row is 1 high.
    """
    half, one = splat(nb.float32(0.5)), splat(nb.float32(1.0))
    inverse = one / maximum(ahead, one)
    t = across * inverse
    a = own.above + _FALL * own.behind**2 + _CAMBER * own.left**2
    b = madd(splat(nb.float32(_CAMBER)) * t, t, splat(nb.float32(_FALL)))
    d = madd(down, inverse, splat(nb.float32(2.0 * _FALL * own.behind)))
    d = madd(splat(nb.float32(2.0 * _CAMBER * own.left)), t, d)
    a, base = splat(nb.float32(a)), splat(nb.float32(own.behind))
    # The upper edge: where rays touch the surface, or the end of the bonnet before.
    side = select_by_sign(
        t, splat(nb.float32(_HALF_WIDTH + own.left)), splat(nb.float32(_HALF_WIDTH - own.left))
    )
    edge = minimum(square_root(a / b), side / maximum(magnitude(t), splat(nb.float32(1e-6))))
    edge = maximum(minimum(edge, splat(nb.float32(own.front))), base)
    # Distances from the edges in pixels: a row is 1/ahead of the slope. Nothing is behind the lens.
    cover = _clamped(madd(d - a / edge - b * edge, ahead, half)) * _clamped(ahead)
    angle = square_root(maximum(d * d - splat(nb.float32(4.0)) * a * b, splat(nb.float32(0.0))))
    rest = maximum(one - angle, splat(nb.float32(0.0)))
    mirrored = madd(splat(nb.float32(0.96)) * (rest * rest), (rest * rest) * rest, splat(nb.float32(0.04)))
    paint, inside = splat(nb.float32(own.paint)), splat(nb.float32(own.inside))
    light = madd(mirrored, splat(nb.float32(own.sky)) - paint, paint)
    below = _clamped(madd(d - a / base - b * base, ahead, half))
    return cover, madd(below, inside - light, light)
