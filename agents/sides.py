"""Cameras of the all-round sensor: forward fields with columns, and fields at both sides of the path."""

from typing import NamedTuple

from lgmd_gym.agents.zones import (
    CONTRAST_S,
    DRY_DECELERATION,
    LOW_ZONES,
    REACHES,
    REACTION,
    SPAN_M,
    zone_camera,
)
from lgmd_gym.aliases import Values

# The forward fields are those of `stopping-zone` at twice the width, because a pedestrian on collision course
# is beside the ego's lane until the last second: all low fields, and the others for every other zone and one
# beyond them for warnings.
FORWARD_WIDTH_PX, FORWARD_SPAN_M, FORWARD_COLUMNS = 160, 2.0 * SPAN_M, 10
_SPARSE = (*REACHES[::2], 2.5)
FORWARD_REACHES = {
    "ground": _SPARSE,
    "upright": _SPARSE,
    "low": tuple(REACHES[zone] for zone in LOW_ZONES),
}
NUM_FORWARD_FIELDS = sum(len(reaches) for reaches in FORWARD_REACHES.values())
FORWARD_NEURON = "dsn"
NEURONS = ("dsn", "edges")  # at the sides
SIDE_WIDTH_PX, SIDE_COLUMNS = 80, 5


class SidePair(NamedTuple):
    """A pair of fields, left and right of the path."""

    yaw_deg: float  # angle between the path and the optical axis [degrees]
    hfov_deg: float  # horizontal field of view [degrees]
    pitch_deg: float  # upward tilt of the optical axis [degrees]
    height_px: int  # height of the frame [px]


# On collision course, a pedestrian (5 km/h) is at a bearing of 5 to 14° for ego speeds of 60 to 20 km/h, a
# bicycle (15 km/h) at 14 to 37°, and a car as fast as the ego at 45°. All fields end just below the horizon:
# there, whatever stands on the ground moves through the frame, unless it is on collision course. Trees and
# houses above the horizon are far away and stand nearly still as well.
SIDES = {
    "near": SidePair(8.0, 14.0, -2.2, 22),
    "middle": SidePair(20.0, 20.0, -2.3, 16),
    "far": SidePair(43.0, 34.0, -1.9, 8),
}
NUM_SIDE_FIELDS = 2 * len(SIDES)  # per neuron
NUM_SIDE_CAMERAS = NUM_SIDE_FIELDS * len(NEURONS)
NUM_ALL_ROUND = NUM_FORWARD_FIELDS + NUM_SIDE_CAMERAS
NUM_FORWARD_COLUMNS = NUM_FORWARD_FIELDS * FORWARD_COLUMNS
NUM_COLUMNS = NUM_FORWARD_COLUMNS + NUM_SIDE_CAMERAS * SIDE_COLUMNS


def forward_cameras() -> list[Values]:
    """Return the channels of the path: five ground, five upright and three low fields.

    The fields of each kind are in the order of their reach, and have ten columns of 0.48 m at the far end.
    Their stopping distance follows the car's estimate of its full braking.
    """
    cameras = [
        zone_camera(kind, reach, DRY_DECELERATION, REACTION)
        for kind, reaches in FORWARD_REACHES.items()
        for reach in reaches
    ]
    return [
        {
            "camera": camera
            | {
                "shape": [camera["shape"][0], FORWARD_WIDTH_PX],
                "gaze": camera["gaze"] | {"span_m": FORWARD_SPAN_M, "brake_known": True},
            },
            "neuron": FORWARD_NEURON,
            "columns": FORWARD_COLUMNS,
        }
        for camera in cameras
    ]


def side_cameras() -> list[Values]:
    """Return the channels at the sides: per neuron the near, middle and far pair, left before right."""
    return [
        {
            "name": f"{name}_{side}_{neuron}",
            "camera": {
                "name": f"{name}_{side}",
                "shape": [pair.height_px, SIDE_WIDTH_PX],
                "hfov_deg": pair.hfov_deg,
                "mount": {"yaw_deg": sign * pair.yaw_deg, "pitch_deg": pair.pitch_deg, "calibrated": True},
                "gaze": {"kind": "path", "derotated": True},
                "sensor": {"contrast_s": CONTRAST_S},
                "stabiliser": "gyroscope",
            },
            "neuron": neuron,
            "columns": SIDE_COLUMNS,
        }
        for neuron in NEURONS
        for name, pair in SIDES.items()
        for side, sign in (("left", -1.0), ("right", 1.0))
    ]


def all_round_cameras() -> list[Values]:
    """Return the forward channels, then those at the sides."""
    return forward_cameras() + side_cameras()
