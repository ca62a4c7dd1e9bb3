"""Kernels of the road markings: solid and striped lines along the lanes, at any distance."""

import math
from typing import NamedTuple

from lgmd_gym.camera.pose import half_frame, side_tangent
from lgmd_gym.camera.render.ground import PAINT, add_quad
from lgmd_gym.kernels import kernel

_FAR = 2000.0  # markings end at this distance [m]


class ViewedLine(NamedTuple):
    """Start [m] and unit direction of a straight line, ahead of and across the lens; its width [m]."""

    ahead: float
    across: float
    d_ahead: float
    d_across: float
    width: float


@kernel
def _add_stroke(layer, lens, line, a, b, weight):
    """Add the part [a, b] of a `ViewedLine` [m]; `weight` is 1, or the share that is painted."""
    ha, hc = -0.5 * line.width * line.d_across, 0.5 * line.width * line.d_ahead
    cos, sin, corners = lens.cos_pitch, lens.sin_pitch, layer.corners
    for i in range(4):
        t = a if i < 2 else b
        side = -1.0 if i == 0 or i == 3 else 1.0
        forward = line.ahead + t * line.d_ahead + side * ha
        corners[i, 0] = forward * cos - lens.z * sin
        corners[i, 1] = line.across + t * line.d_across + side * hc
        corners[i, 2] = forward * sin + lens.z * cos
    add_quad(layer, PAINT, lens, weight)


@kernel
def _visible_part(lens, line, length):
    """Return the part [a, b] of a line between the near plane, the far end and the sides of the view [m].

    The lower side of the frame also bounds it: a narrow view begins tens of metres ahead.
    """
    ahead, across, d_ahead, d_across, width = line
    tan = side_tangent(lens)
    low = half_frame(lens)[1] / lens.focal
    rise, drop = low * lens.cos_pitch - lens.sin_pitch, lens.z * (lens.cos_pitch + low * lens.sin_pitch)
    a, b = 0.0, length
    for side in range(5 if tan >= 0.0 else 0):
        if side == 0:
            p, q = ahead + 0.5, d_ahead
        elif side == 1:
            p, q = _FAR - ahead, -d_ahead
        elif side == 2:
            p, q = tan * ahead + across + 2.0, tan * d_ahead + d_across
        elif side == 3:
            p, q = tan * ahead - across + 2.0, tan * d_ahead - d_across
        else:
            p, q = rise * ahead - drop + abs(rise) * width, rise * d_ahead
        # Keep where p + q·t >= 0.
        if abs(q) < 1e-12:
            if p < 0.0:
                return 1.0, 0.0
        elif q > 0.0:
            a = max(a, -p / q)
        else:
            b = min(b, -p / q)
    return a, b


@kernel
def _separate_stripes(lens, line, a, b, period):
    """Return the part of [a, b] drawn as separate stripes: up to three periods per pixel [m]."""
    along, across = abs(line.d_ahead), abs(line.d_across)
    f, h = lens.focal, lens.z
    # along·Z²/(f·h) + across·Z/f = 3 periods, solved for the distance ahead Z.
    p, q, r = along / (f * h), across / f, 3.0 * period
    limit = (math.sqrt(q * q + 4.0 * p * r) - q) / (2.0 * p) if p > 1e-9 else r / max(q, 1e-9)
    if abs(line.d_ahead) < 1e-9:
        return (a, b) if line.ahead < limit else (b, b)
    t = (limit - line.ahead) / line.d_ahead
    # The near part is striped, in either direction of the line.
    return (a, min(max(t, a), b)) if line.d_ahead > 0.0 else (min(max(t, a), b), b)


@kernel
def _add_striped(layer, lens, line, s0, a, b, look):
    """Add the part [a, b] of a striped line that starts s0 along its lane [m]; far stripes as their mean."""
    dash, period = look.dash, look.dash_period
    near_a, near_b = _separate_stripes(lens, line, a, b, period)
    if near_a > a:
        _add_stroke(layer, lens, line, a, near_a, dash / period)
    if near_b < b:
        _add_stroke(layer, lens, line, near_b, b, dash / period)
    k = math.floor((s0 + near_a) / period)
    while k * period < s0 + near_b:
        start = max(k * period - s0, near_a)
        end = min(k * period + dash - s0, near_b)
        if end > start:
            _add_stroke(layer, lens, line, start, end, 1.0)
        k += 1


@kernel
def add_lines(layer, lens, lines, look):
    """Add all markings, `RoadGeometry.lines`, to the ground layer, in the style of a `LOOK` record."""
    c, s = lens.cos_yaw, lens.sin_yaw
    for i in range(lines.shape[0]):
        piece = lines[i]
        x0, y0 = piece.x0 - lens.x, piece.y0 - lens.y
        dx, dy = piece.x1 - piece.x0, piece.y1 - piece.y0
        length = math.sqrt(dx * dx + dy * dy)
        if not length > 0.0:
            continue
        dx, dy = dx / length, dy / length
        line = ViewedLine(x0 * c + y0 * s, y0 * c - x0 * s, dx * c + dy * s, dy * c - dx * s, look.line_width)
        a, b = _visible_part(lens, line, length)
        if not b > a:
            continue
        if piece.striped == 0.0:
            _add_stroke(layer, lens, line, a, b, 1.0)
        else:
            _add_striped(layer, lens, line, piece.start, a, b, look)
