"""Visible and striped parts of markings: every expected value is computed by hand."""

from math import atan, inf, tan

import pytest
from support.records import frustum_of, lens_of

from lgmd_gym.camera.render.ground import ViewedLine, _separate_stripes, _visible_part


@pytest.mark.parametrize(
    ("line", "length", "expected"),
    [
        # The lens is 1 m high; the lower side of the frame has the tangent 0.4, with 0.15 m to spare.
        ((0.0, 0.0, 1.0, 0.0), 5000.0, (2.35, 2000.0)),
        ((0.0, 0.0, 1.0, 0.0), 100.0, (2.35, 100.0)),
        ((20.0, 0.0, 1.0, 0.0), 100.0, (0.0, 100.0)),
        ((100.0, 0.0, -1.0, 0.0), 5000.0, (0.0, 97.65)),
        ((3000.0, 0.0, -1.0, 0.0), 5000.0, (1000.0, 2997.65)),
        # The sides of the view have the tangent 0.6, with 2 m to spare: 32 m at 50 m.
        ((50.0, -1000.0, 0.0, 1.0), 2000.0, (968.0, 1032.0)),
        ((50.0, 1000.0, 0.0, -1.0), 2000.0, (968.0, 1032.0)),
        ((2.4, -1000.0, 0.0, 1.0), 2000.0, (996.56, 1003.44)),
        ((1999.0, 0.0, 0.0, 1.0), 10.0, (0.0, 10.0)),
        # 8 m beside at 10 m; the line nears the side with 0.8 - 0.6·0.6 = 0.44.
        ((10.0, 0.0, 0.6, 0.8), 1000.0, (0.0, 8.0 / 0.44)),
        ((10.0, 0.0, 0.6, -0.8), 1000.0, (0.0, 8.0 / 0.44)),
    ],
)
def test_visible_part_of_a_line(line, length, expected):
    assert _visible_part(frustum_of(), ViewedLine(*line, 0.15), length) == pytest.approx(expected)


@pytest.mark.parametrize("ahead", [-0.6, -0.4, 2.3, 2001.0])
def test_crossing_line_outside_the_view(ahead):
    a, b = _visible_part(frustum_of(), ViewedLine(ahead, -5.0, 0.0, 1.0, 0.15), 10.0)
    assert not b > a


@pytest.mark.parametrize("pitch", [-0.1, 0.0, 0.1])
def test_lower_side_of_a_pitched_frame(pitch):
    a, _ = _visible_part(frustum_of(pitch=pitch, z=2.0), ViewedLine(0.0, 0.0, 1.0, 0.0, 0.15), 100.0)
    assert a == pytest.approx(2 / tan(atan(0.4) - pitch) - 0.15)


def test_frame_above_the_horizon_shows_no_line():
    a, b = _visible_part(frustum_of(pitch=0.5), ViewedLine(0.0, 0.0, 1.0, 0.0, 0.15), 100.0)
    assert not b > a


def test_lines_right_below_a_lens_that_looks_down():
    # The frame contains the ground behind the lens.
    a, b = _visible_part(frustum_of(pitch=-1.5, z=2.0), ViewedLine(10.0, 0.0, -1.0, 0.0, 0.15), 100.0)
    assert (a, b) == (0.0, 100.0)
    # With a pitch of -1 rad, the lower side of the frame is 1.38 rad below the horizon.
    a, b = _visible_part(frustum_of(pitch=-1.0, z=2.0), ViewedLine(10.0, 0.0, -1.0, 0.0, 0.15), 100.0)
    assert (a, b) == (0.0, pytest.approx(10.0 - 2.0 / tan(1.0 + atan(0.4)) + 0.15))


# Stripes are separate where three periods of 4.33 m are at least one pixel.
ALONG = (3 * 4.33 * 100) ** 0.5  # Z²/(f·h), with f = 100 px and h = 1 m: 36.04 m
ACROSS = 3 * 4.33 * 100  # Z/f


@pytest.mark.parametrize(
    ("line", "part", "expected"),
    [
        ((10.0, 0.0, 1.0, 0.0), (0.0, 100.0), (0.0, ALONG - 10)),
        ((10.0, 0.0, 1.0, 0.0), (5.0, 20.0), (5.0, 20.0)),
        ((50.0, 0.0, 1.0, 0.0), (5.0, 100.0), (5.0, 5.0)),
        ((100.0, 0.0, -1.0, 0.0), (0.0, 95.0), (100 - ALONG, 95.0)),
        ((30.0, 0.0, -1.0, 0.0), (2.0, 25.0), (2.0, 25.0)),
        ((100.0, 0.0, -1.0, 0.0), (0.0, 50.0), (50.0, 50.0)),
        ((ACROSS - 1, -5.0, 0.0, 1.0), (1.0, 9.0), (1.0, 9.0)),
        ((ACROSS + 1, -5.0, 0.0, 1.0), (1.0, 9.0), (9.0, 9.0)),
    ],
)
def test_separate_stripes(line, part, expected):
    assert _separate_stripes(lens_of(), ViewedLine(*line, 0.15), *part, 4.33) == pytest.approx(expected)


@pytest.mark.parametrize(("focal", "height"), [(100.0, 1.0), (300.0, 2.0)])
@pytest.mark.parametrize("side", [0.8, -0.8])
def test_separate_stripes_of_an_oblique_line(side, focal, height):
    lens = lens_of(focal=focal, z=height)
    _, end = _separate_stripes(lens, ViewedLine(0.0, 0.0, 0.6, side, 0.15), 0.0, inf, 4.33)
    ahead = 0.6 * end
    assert 0.6 * ahead**2 / (focal * height) + 0.8 * ahead / focal == pytest.approx(3 * 4.33)
