"""Fields at both sides of the path, each with an LGMD and a direction-selective neuron."""

from typing import Any

from lgmd_gym.agents.zones import CONTRAST_S, NUM_FIELDS, zone_cameras

# Yaw of the optical axis from the path, horizontal field of view and pitch of each pair of fields [degrees].
# On collision course, a pedestrian (5 km/h) is at a bearing of 5 to 14° for ego speeds of 60 to 20 km/h, a
# bicycle (15 km/h) at 14 to 37°, and a car as fast as the ego at 45°.
SIDES = {"near": (8.0, 14.0, -0.7), "middle": (20.0, 20.0, -1.5), "far": (43.0, 34.0, -3.0)}
DETECTORS = ("lgmd", "dsn")
SIDE_SHAPE = (40, 80)  # (height, width) [px]
NUM_SIDE_FIELDS = 2 * len(SIDES) * len(DETECTORS)
NUM_ALL_ROUND = NUM_FIELDS + NUM_SIDE_FIELDS


def side_cameras() -> list[dict[str, Any]]:
    """Return the cameras at the sides: per detector the near, middle and far pair, left before right."""
    return [
        {
            "name": f"{name}_{side}_{detector}",
            "shape": list(SIDE_SHAPE),
            "detector": detector,
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
    """Return the cameras of `stopping-zone`, then those at the sides."""
    return zone_cameras() + side_cameras()
