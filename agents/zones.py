"""Geometry of the stopping zones: parts of the ego's path, at multiples of the stopping distance.

The far end of a zone is at its reach, a multiple of the stopping distance at the present speed. Its fields
are 2.4 m wide there at every speed, see the gaze `ToStoppingPoint`. A field is a band of rows:
the ground field covers the road surface in front of the far end, the low field what stands there up to
0.7 of the height of the camera, and the upright field the horizon.
"""

from typing import TypeVar

import numpy as np

from lgmd_gym.aliases import Values

REACHES = (0.28, 0.4, 0.55, 0.75, 1.0, 1.35, 1.8)
"""Reach of each zone, nearest first."""
NUM_ZONES = len(REACHES)
LOW_ZONES = (3, 4, 5)
"""Zones with a low field."""
LOW_FIELD = (0, 0, 0, 0, 1, 2, 2)
"""Index of the low field for each zone: its own, or that of the nearest zone with one."""
NUM_FIELDS = 2 * NUM_ZONES + len(LOW_ZONES)
SPAN_M = 2.4  # width of a field at the far end of its zone
CONTRAST_S = 0.5  # time constant of the contrast control of each field [s]
DRY_DECELERATION, REACTION = (
    7.5,
    0.5,
)  # of the stopping distance [m/s², s]; see `ToStoppingPoint`
# Frame shape (height, width) [px] and elevation of each kind of field. The unit of elevation is the angle
# from the horizon down to the zone's far end. In this unit a ground field spans -1.43 to -0.98, a low field
# -0.9 to -0.3 and an upright field -0.15 to 0.35. The top of a car 1.4 m high at the far end is at 0.17.
FIELDS = {"ground": ((18, 80), -1.2), "upright": ((20, 80), 0.1), "low": ((24, 80), -0.6)}
FULL_DECELERATION = 9.0  # deceleration of full braking in the laboratory [m/s²]
CAMERA_SETBACK = 1.7  # distance of the camera behind the front bumper [m]

Speed = TypeVar("Speed", float, np.ndarray)


def stopping_distance(speed: Speed, deceleration: float, reaction: float) -> Speed:
    """Return the stopping distance v²/(2 · deceleration) + v · reaction [m] for a speed v [m/s]."""
    return speed**2 / (2 * deceleration) + speed * reaction


def zone_cameras(deceleration: float = DRY_DECELERATION, reaction: float = REACTION) -> list[Values]:
    """Return the cameras of all fields: seven ground fields, seven upright fields, three low fields.

    Args:
        deceleration: Deceleration of the stopping distance on a dry road [m/s²].
        reaction: Reaction time of the stopping distance [s].
    """
    zones = {"ground": REACHES, "upright": REACHES, "low": [REACHES[zone] for zone in LOW_ZONES]}
    return [
        zone_camera(kind, reach, deceleration, reaction)
        for kind, reaches in zones.items()
        for reach in reaches
    ]


def zone_camera(kind: str, reach: float, deceleration: float, reaction: float) -> Values:
    """Return the camera of one field.

    Args:
        kind: A key of `FIELDS`.
        reach: Reach of the zone.
        deceleration: Deceleration of the stopping distance on a dry road [m/s²].
        reaction: Reaction time of the stopping distance [s].
    """
    shape, lift = FIELDS[kind]
    return {
        "name": f"{kind}{reach:g}",
        "shape": list(shape),
        "mount": {"calibrated": True},
        "gaze": {
            "kind": "stopping",
            "reach": reach,
            "span_m": SPAN_M,
            "lift": lift,
            "deceleration": deceleration,
            "reaction_s": reaction,
        },
        "sensor": {"contrast_s": CONTRAST_S},
        "stabiliser": "gyroscope",
    }
