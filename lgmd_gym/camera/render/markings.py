"""Kernels of the markings: solid and striped lines along the lanes, at any distance."""

from __future__ import annotations

import math

from lgmd_gym.camera.pinhole import (
    CAM_COS_PITCH,
    CAM_COS_YAW,
    CAM_CU,
    CAM_FOCAL,
    CAM_SIN_PITCH,
    CAM_SIN_YAW,
    CAM_X,
    CAM_Y,
    CAM_Z,
)
from lgmd_gym.camera.render.ground import PAINT, add_quad
from lgmd_gym.camera.render.jit import kernel

STRIPE_LENGTH = 3.0  # [m], and
STRIPE_PERIOD = 4.33  # [m]: highway_env.road.graphics.LaneGraphics
LINE_WIDTH = 0.15
"""Width of a marking [m]; highway-env's own top view paints them twice as wide."""
_FAR = 2000.0  # markings end here [m]


@kernel
def _add_stroke(acc, cam, axes, a, b, weight, pts, uv):
    """Add the stretch [a, b] of a straight line.

    Args:
        acc: Ground accumulator.
        cam: `camera_vector(...)`.
        axes: The line's start and direction as (ahead, across) of the lens.
        a: Start along the line [m].
        b: End along the line [m].
        weight: 1, or the share of it that is painted.
        pts: Scratch for corners in camera axes.
        uv: Scratch for projected corners.
    """
    ahead, across, d_ahead, d_across = axes
    ha, hc = -0.5 * LINE_WIDTH * d_across, 0.5 * LINE_WIDTH * d_ahead
    cos, sin = cam[CAM_COS_PITCH], cam[CAM_SIN_PITCH]
    for i in range(4):
        t = a if i < 2 else b
        side = -1.0 if i == 0 or i == 3 else 1.0
        forward = ahead + t * d_ahead + side * ha
        pts[i, 0] = forward * cos - cam[CAM_Z] * sin
        pts[i, 1] = across + t * d_across + side * hc
        pts[i, 2] = forward * sin + cam[CAM_Z] * cos
    add_quad(acc, PAINT, cam, weight, pts, uv)


@kernel
def _visible_stretch(cam, axes, length):
    """Part [a, b] of a line between the near plane, the far end and the sides of the view."""
    ahead, across, d_ahead, d_across = axes
    # The pixel columns' half-plane, widened for pitch and the line's own width.
    tan = 1.3 * cam[CAM_CU] / cam[CAM_FOCAL]
    a, b = 0.0, length
    for side in range(4):
        if side == 0:
            p, q = ahead + 0.5, d_ahead
        elif side == 1:
            p, q = _FAR - ahead, -d_ahead
        elif side == 2:
            p, q = tan * ahead + across + 2.0, tan * d_ahead + d_across
        else:
            p, q = tan * ahead - across + 2.0, tan * d_ahead - d_across
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
def _stripes_end(cam, axes, a, b):
    """Part of [a, b] whose stripes are told apart; where a pixel covers three, their mean is drawn."""
    start, speed = axes[0], axes[2]
    along, across = abs(speed), abs(axes[3])
    f, h = cam[CAM_FOCAL], cam[CAM_Z]
    # along·Z²/(f·h) + across·Z/f = 3 periods, solved for the distance ahead Z.
    p, q, r = along / (f * h), across / f, 3.0 * STRIPE_PERIOD
    limit = (math.sqrt(q * q + 4.0 * p * r) - q) / (2.0 * p) if p > 1e-9 else r / max(q, 1e-9)
    if abs(speed) < 1e-9:
        return (a, b) if start < limit else (b, b)
    t = (limit - start) / speed
    # Ahead of the lens the striped part is the near one, whichever way the line runs.
    return (a, min(max(t, a), b)) if speed > 0.0 else (min(max(t, a), b), b)


@kernel
def _add_striped(acc, cam, axes, s0, a, b, pts, uv):
    """Add the visible stretch [a, b] of a striped line that starts s0 metres along its lane."""
    near_a, near_b = _stripes_end(cam, axes, a, b)
    if near_a > a:
        _add_stroke(acc, cam, axes, a, near_a, STRIPE_LENGTH / STRIPE_PERIOD, pts, uv)
    if near_b < b:
        _add_stroke(acc, cam, axes, near_b, b, STRIPE_LENGTH / STRIPE_PERIOD, pts, uv)
    k = math.floor((s0 + near_a) / STRIPE_PERIOD)
    while k * STRIPE_PERIOD < s0 + near_b:
        start = max(k * STRIPE_PERIOD - s0, near_a)
        end = min(k * STRIPE_PERIOD + STRIPE_LENGTH - s0, near_b)
        if end > start:
            _add_stroke(acc, cam, axes, start, end, 1.0, pts, uv)
        k += 1


@kernel
def add_lines(acc, cam, lines, pts, uv):
    """Add all markings.

    Args:
        acc: Ground accumulator, float32, shape (height, width + 2, 3).
        cam: `camera_vector(...)`.
        lines: `RoadGeometry.lines`.
        pts: Scratch for corners in camera axes.
        uv: Scratch for projected corners.
    """
    c, s = cam[CAM_COS_YAW], cam[CAM_SIN_YAW]
    for i in range(lines.shape[0]):
        x0, y0 = lines[i, 0] - cam[CAM_X], lines[i, 1] - cam[CAM_Y]
        dx, dy = lines[i, 2] - lines[i, 0], lines[i, 3] - lines[i, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if not length > 0.0:
            continue
        dx, dy = dx / length, dy / length
        axes = (x0 * c + y0 * s, y0 * c - x0 * s, dx * c + dy * s, dy * c - dx * s)
        a, b = _visible_stretch(cam, axes, length)
        if not b > a:
            continue
        if lines[i, 6] == 0.0:
            _add_stroke(acc, cam, axes, a, b, 1.0, pts, uv)
        else:
            _add_striped(acc, cam, axes, lines[i, 4], a, b, pts, uv)
