"""The cameras at the sides of the path."""

from itertools import pairwise
from math import atan, degrees, radians, tan

import pytest

from lgmd_gym.agents.sides import side_cameras


@pytest.mark.parametrize("camera", side_cameras(), ids=lambda camera: camera["name"])
def test_fields_end_just_below_the_horizon(camera):
    """Distant objects above the horizon stand nearly still, as a threat does."""
    height, width = camera["shape"]
    focal_px = width / 2 / tan(radians(camera["hfov_deg"] / 2))
    top = camera["pitch_deg"] + degrees(atan(height / 2 / focal_px))
    assert -0.5 < top < -0.1


def test_fields_cover_both_sides_without_a_gap():
    for sign in (-1.0, 1.0):
        fields = [camera for camera in side_cameras() if camera["detector"] == "lgmd"]
        spans = sorted(
            (
                sign * camera["yaw_deg"] - camera["hfov_deg"] / 2,
                sign * camera["yaw_deg"] + camera["hfov_deg"] / 2,
            )
            for camera in fields
            if sign * camera["yaw_deg"] > 0.0
        )
        assert spans[0][0] == 1.0
        assert spans[-1][1] == 60.0
        assert all(right[0] <= left[1] for left, right in pairwise(spans))
