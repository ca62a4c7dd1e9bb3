"""Records of physics and camera that kernels can read, compiled or not (`NUMBA_DISABLE_JIT=1`)."""

from math import cos, inf, sin

import numpy as np

from lgmd_gym.camera.pinhole import LENS
from lgmd_gym.camera.render.seen import FRUSTUM, aim_frustum
from lgmd_gym.envs.dynamics.bodies import BODY, CAR
from lgmd_gym.envs.dynamics.brake import BRAKE


def records(dtype, *rows):
    """Return an array with one record per dict of fields; fields are attributes of its records."""
    table = np.zeros(len(rows), dtype).view(np.recarray)
    for record, fields in zip(table, rows, strict=True):
        for name, value in fields.items():
            record[name] = value
    return table


def record(dtype, **fields):
    """Return one record."""
    return records(dtype, fields)[0]


def bodies(*rows):
    """Return `BODY` records of 4 m by 2 m on straight paths from their positions, and the table of paths."""
    size = {"length": 4.0, "width": 2.0, "kind": CAR}
    paths = [{"path": number, "path_end": number + 1} for number in range(len(rows))]
    table = records(BODY, *(size | path | row for path, row in zip(paths, rows, strict=True)))
    starts = np.array([(0.0, body.x, body.y, body.heading, 0.0, 0.0) for body in table])
    return table, starts


def brake_of(**values):
    """Return a `BRAKE` record without delay: 8 m/s² at once."""
    defaults = {"max_deceleration": 8.0, "max_acceleration": 3.0, "jerk": inf, "regain_acceleration": 2.0}
    return record(BRAKE, **(defaults | values))


def lens_of(yaw=0.0, pitch=0.0, focal=100.0, shape=(80, 120), roll=0.0, **position):
    """Return a `LENS` record at a height of 1 m unless stated otherwise."""
    angles = {"yaw": yaw, "pitch": pitch, "roll": roll}
    turns = {f"{name}_{key}": f(x) for key, x in angles.items() for name, f in (("cos", cos), ("sin", sin))}
    centre = {"centre_u": shape[1] / 2, "centre_v": shape[0] / 2}
    return record(LENS, focal=focal, **({"z": 1.0} | position), **angles, **turns, **centre)


def frustum_of(**lens):
    """Return the `FRUSTUM` record of a lens, given as in `lens_of`."""
    frustum = record(FRUSTUM)
    aim_frustum(lens_of(**lens), frustum)
    return frustum
