"""The cameras at the sides of the path."""

from itertools import pairwise
from math import atan, degrees, radians, tan

import pytest

from lgmd_gym.agents.sides import side_cameras
from lgmd_gym.sensing.channel import make_channels


@pytest.mark.parametrize("channel", make_channels(side_cameras()), ids=lambda channel: channel.name)
def test_fields_end_just_below_the_horizon(channel):
    """Distant objects above the horizon stand nearly still, as a threat does."""
    camera = channel.camera
    height, width = camera.shape
    focal_px = width / 2 / tan(radians(camera.hfov_deg / 2))
    top = camera.mount.pitch_deg + degrees(atan(height / 2 / focal_px))
    assert -0.5 < top < -0.1


def test_fields_cover_both_sides_without_a_gap():
    for sign in (-1.0, 1.0):
        cameras = [item.camera for item in make_channels(side_cameras()) if item.neuron == "dsn"]
        fields = [(camera.mount.yaw_deg, camera.hfov_deg) for camera in cameras]
        spans = sorted(
            (sign * yaw_deg - hfov_deg / 2, sign * yaw_deg + hfov_deg / 2)
            for yaw_deg, hfov_deg in fields
            if sign * yaw_deg > 0.0
        )
        assert spans[0][0] == 1.0
        assert spans[-1][1] == 60.0
        assert all(right[0] <= left[1] for left, right in pairwise(spans))
