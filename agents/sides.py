"""Cameras of the all-round sensor: forward fields with columns, and fields at both sides of the path."""

from typing import Any

from lgmd_gym.agents.zones import CONTRAST_S, NUM_FIELDS, SPAN_M, zone_cameras

# The forward fields are those of `stopping-zone` at twice the width: a pedestrian on collision course is
# beside the ego's lane until the last second.
FORWARD_WIDTH_PX, FORWARD_SPAN_M, FORWARD_COLUMNS = 160, 2.0 * SPAN_M, 10
# Yaw of the optical axis from the path, horizontal field of view and pitch of each pair of fields [degrees].
# On collision course, a pedestrian (5 km/h) is at a bearing of 5 to 14° for ego speeds of 60 to 20 km/h, a
# bicycle (15 km/h) at 14 to 37°, and a car as fast as the ego at 45°.
SIDES = {"near": (8.0, 14.0, -0.7), "middle": (20.0, 20.0, -1.5), "far": (43.0, 34.0, -3.0)}
DETECTORS = ("lgmd", "dsn", "edges")
SIDE_SHAPE, SIDE_COLUMNS = (40, 80), 5  # (height, width) [px]
NUM_SIDE_FIELDS = 2 * len(SIDES)  # per detector
NUM_MOTION_FIELDS = NUM_FIELDS + 2 * NUM_SIDE_FIELDS  # without the detectors of edges
NUM_ALL_ROUND = NUM_FIELDS + NUM_SIDE_FIELDS * len(DETECTORS)
NUM_FORWARD_COLUMNS = NUM_FIELDS * FORWARD_COLUMNS
NUM_COLUMNS = NUM_FORWARD_COLUMNS + NUM_SIDE_FIELDS * len(DETECTORS) * SIDE_COLUMNS


def forward_cameras() -> list[dict[str, Any]]:
    """Return the cameras of `stopping-zone` at twice the width, with ten columns of 0.48 m at the far end.

    Their stopping distance follows the car's estimate of its full braking.
    """
    return [
        camera
        | {
            "shape": [camera["shape"][0], FORWARD_WIDTH_PX],
            "span_m": FORWARD_SPAN_M,
            "columns": FORWARD_COLUMNS,
            "brake_known": True,
        }
        for camera in zone_cameras()
    ]


def side_cameras() -> list[dict[str, Any]]:
    """Return the cameras at the sides: per detector the near, middle and far pair, left before right."""
    return [
        {
            "name": f"{name}_{side}_{detector}",
            "shape": list(SIDE_SHAPE),
            "detector": detector,
            "columns": SIDE_COLUMNS,
            "gaze": "path",
            "yaw_deg": sign * yaw_deg,
            "hfov_deg": hfov_deg,
            "pitch_deg": pitch_deg,
            "stabilised": True,
            "calibrated": True,
            "contrast_s": CONTRAST_S,
        }
        for detector in DETECTORS
        for name, (yaw_deg, hfov_deg, pitch_deg) in SIDES.items()
        for side, sign in (("left", -1.0), ("right", 1.0))
    ]


def all_round_cameras() -> list[dict[str, Any]]:
    """Return the forward cameras, then those at the sides."""
    return forward_cameras() + side_cameras()
