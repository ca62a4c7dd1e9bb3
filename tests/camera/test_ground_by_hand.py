"""Distance, texture and markings of the ground: every expected value is computed by hand."""

from math import atan, cos, hypot, pi, sin, tan

import numba as nb
import numpy as np
import pytest
from support.cameras import rig
from support.records import frustum_of, lens_of, record
from support.roads import ring_road

from lgmd_gym.camera.effects import look_of
from lgmd_gym.camera.render.buffers import GroundLayer
from lgmd_gym.camera.render.ground import PAINT, ROAD, add_lines, add_road
from lgmd_gym.camera.render.seen import FRUSTUM
from lgmd_gym.camera.render.texture import TEXEL_M, bend_of, bent_texels, distance_ahead, texture_line
from lgmd_gym.camera.road_geometry import STRIPED, line_records, quad_records, road_geometry
from lgmd_gym.kernels import kernel
from lgmd_gym.kernels.simd import as_floats, lane_numbers, splat, store

compiled_only = pytest.mark.skipif(nb.config.DISABLE_JIT, reason="LLVM vectors exist in compiled code only")


@pytest.mark.parametrize("pitch", [0.0, -0.1, 0.05])
@pytest.mark.parametrize("row", [60, 79])
def test_distance_of_the_ground(row, pitch):
    below = atan((row + 0.5 - 40) / 100) - pitch  # angle below the horizon
    assert distance_ahead(lens_of(pitch=pitch), row) == pytest.approx(1 / tan(below))


def test_distance_of_the_ground_is_limited():
    assert distance_ahead(lens_of(), 39) == 1e5
    assert distance_ahead(lens_of(), 40) == pytest.approx(200.0)


LEVELS = np.arange(13 * 10, dtype=np.int64).reshape(13, 10)


@pytest.mark.parametrize("yaw", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("pitch", [0.0, -0.1, 0.1])
def test_texture_is_anchored_to_the_ground(yaw, pitch):
    """Pixel [row, column] shows the texel at the ground point of its centre, at any pose."""
    lens = lens_of(yaw, pitch, x=31.7, y=-4.2)
    line = texture_line(lens, 70, LEVELS)
    ahead = 1 / tan(atan(0.305) - pitch)  # row 70 is 30.5 px below the middle
    depth = ahead * cos(pitch) - sin(pitch)
    for column in (0, 37, 119):
        right = (column + 0.5 - 60) / 100 * depth
        x = 31.7 + ahead * cos(yaw) - right * sin(yaw)
        y = -4.2 + ahead * sin(yaw) + right * cos(yaw)
        # The centre of texel n of level i is at (n + 0.5)·2^i texels.
        i, j = 12 - line.log_x, 9 - line.log_y
        period_x, period_y = 2.0**line.log_x, 2.0**line.log_y
        place = (line.x + column * line.dx) % period_x, (line.y + column * line.dy) % period_y
        expected = (x / (TEXEL_M * 2**i) - 0.5) % period_x, (y / (TEXEL_M * 2**j) - 0.5) % period_y
        assert place == pytest.approx(expected)
    assert line.start == LEVELS[i, j]
    assert 0 <= line.x < period_x
    assert 0 <= line.y < period_y


@kernel
def write_bends(line, bends, lanes):
    """Write the shifts of 128 pixels of a row, x and y, in 1/65536 texels; `lanes` is scratch memory."""
    bend = bend_of(line, 120)
    for j in range(0, 128, 16):
        x, y = bent_texels(bend, as_floats(lane_numbers()) + splat(nb.float32(j + bend.first)))
        store(lanes, 0, as_floats(x))
        store(lanes, 16, as_floats(y))
        for lane in range(16):
            bends[0, j + lane], bends[1, j + lane] = lanes[lane], lanes[16 + lane]


@compiled_only
@pytest.mark.parametrize(("roll", "row"), [(0.01, 70), (-0.2, 75), (0.2, 45), (-0.2, 37)])
def test_texture_of_a_rolling_lens_is_anchored_to_the_ground(roll, row):
    """Places are exact along the row, also where only a part of it is below the horizon."""
    lens, checked = lens_of(0.5, 0.02, x=31.7, y=-4.2, roll=roll), 0
    line, bends = texture_line(lens, row, LEVELS), np.zeros((2, 128), np.float32)
    write_bends(line, bends, np.zeros(32, np.float32))
    steps, sizes = (line.dx, line.dy), (line.log_x, line.log_y)
    for column in range(120):
        u, v = column + 0.5 - 60, row + 0.5 - 40
        right, down = u * cos(roll) - v * sin(roll), v * cos(roll) + u * sin(roll)
        fall = down * cos(0.02) - 100 * sin(0.02)
        if fall < 1.0:
            continue
        ahead, across = (100 * cos(0.02) + down * sin(0.02)) / fall, right / fall
        place = 31.7 + ahead * cos(0.5) - across * sin(0.5), -4.2 + ahead * sin(0.5) + across * cos(0.5)
        for axis in range(2):
            texel = TEXEL_M * (4096, 512)[axis] / 2 ** sizes[axis]
            found = (line.x, line.y)[axis] + column * steps[axis] + bends[axis, column] / 65536
            error = (found - place[axis] / texel + 0.5) % 2.0 ** sizes[axis]
            assert min(error, 2.0 ** sizes[axis] - error) < 2e-3 * hypot(*steps) + 2e-3
        checked += 1
    assert checked > 20


@pytest.mark.parametrize(
    ("focal", "row", "levels"),
    [
        # Footprint of a pixel: Z²/(f·h) along, Z/f across; the level is its rounded log2 in texels of 4 cm.
        (100.0, 70, (1, 0)),  # 10.75 cm = 2.7 texels, 3.3 cm = 0.8 texel
        (100.0, 50, (3, 1)),  # 90.7 cm = 22.7 texels -> 4.5, 9.5 cm = 2.4 texels -> 1.25
        (100.0, 40, (12, 6)),  # 400 m, 2 m
    ],
)
def test_level_of_the_texture_is_the_footprint_of_a_pixel(focal, row, levels):
    v = row + 0.5 - 40
    along, across = focal / v**2 / TEXEL_M, 1 / v / TEXEL_M
    if v < 1:
        along = focal / v / 0.5 / TEXEL_M
    expected = tuple(
        int(np.clip(np.floor(np.log2(size) + 0.5), 0, top)) for size, top in ((along, 12), (across, 9))
    )
    line = texture_line(lens_of(focal=focal), row, LEVELS)
    assert (12 - line.log_x, 9 - line.log_y) == expected
    turned = texture_line(lens_of(pi / 2, focal=focal), row, LEVELS)
    assert 12 - turned.log_x == min(max(int(np.floor(np.log2(across) + 0.5)), 0), 12)


LOOK = look_of(*rig()).reshape(1).view(np.recarray)[0]
LINE_WIDTH = 0.15


def painted(*lines, yaw=0.0, x=0.0, y=0.0, shape=(160, 120)):
    """Return the area painted by lines (x0, y0, x1, y1, start, striped) in square metres by column [px]."""
    coverage = np.zeros((4, shape[0], shape[1] + 2), np.float32)
    pose = {"yaw": yaw, "pitch": -pi / 2 + 1e-9, "z": 10.0, "x": x, "y": y, "shape": shape}
    lens = lens_of(**pose)
    layer = GroundLayer(coverage, np.zeros((3, 16)), np.zeros((2, 20)), np.zeros((2, 8)), frustum_of(**pose))
    add_lines(layer, lens, line_records(np.array(lines)).view(np.recarray), LOOK)
    return np.cumsum(coverage[PAINT], axis=1)[:, :-2] / 100


def test_solid_line():
    area = painted((0.0, 1.0, 5.0, 1.0, 0.0, 0.0))
    # Ahead is up from the middle, row 80; y = 1 m is column 70.
    assert area.sum() == pytest.approx(5 * LINE_WIDTH, rel=1e-4)
    rows, columns = np.flatnonzero(area.sum(axis=1) > 1e-6), np.flatnonzero(area.sum(axis=0) > 1e-6)
    assert (rows[0], rows[-1] + 1) == (30, 80)
    assert (columns[0], columns[-1] + 1) == (69, 71)


@pytest.mark.parametrize("yaw", [0.0, 0.7, pi / 2, 3.0])
@pytest.mark.parametrize("start", [0.0, 2.0, 4.0])
def test_stripes_are_three_metres_in_four_and_a_third_by_area(yaw, start):
    """A line of 5 m straight ahead, from `start` of its lane on."""
    area = painted((0.0, 0.0, 5 * cos(yaw), 5 * sin(yaw), start, 1.0), yaw=yaw)
    painted_m = {0.0: 3.0 + 0.67, 2.0: 1.0 + 2.67, 4.0: 3.0 + 0.34}[start]
    assert area.sum() == pytest.approx(painted_m * LINE_WIDTH, rel=2e-3)


@compiled_only
def test_oblique_line():
    area = painted((1.0, -2.0, 4.0, 2.0, 0.0, 0.0))
    assert area.sum() == pytest.approx(5 * LINE_WIDTH, rel=1e-4)
    # Its middle is at (2.5 m, 0): 25 px above the middle of the frame.
    rows, columns = np.indices(area.shape) + 0.5
    centre = (area * rows).sum() / area.sum(), (area * columns).sum() / area.sum()
    assert centre == pytest.approx((80 - 25, 60), abs=0.01)


@compiled_only
def test_lines_are_relative_to_the_lens():
    line = (3.0, 1.0, 5.0, 2.0, 0.0, 0.0)
    moved = (3.0 + 40, 1.0 - 25, 5.0 + 40, 2.0 - 25, 0.0, 0.0)
    np.testing.assert_allclose(painted(moved, x=40.0, y=-25.0), painted(line), atol=1e-5)


def test_ends_of_the_stripes():
    area = painted((0.0, 0.0, 5.0, 0.0, 2.0, 1.0)).sum(axis=1)
    share = area[79::-1] / area.max()  # from the near end on, 10 rows per metre
    # 1 m, a gap of 1.33 m, then 2.67 m.
    assert share[:10] == pytest.approx(1.0, abs=0.01)
    assert share[10:23] == pytest.approx(0.0, abs=0.01)
    assert share[23] == pytest.approx(0.7, abs=0.01)
    assert share[24:50] == pytest.approx(1.0, abs=0.01)
    assert share[50:] == pytest.approx(0.0, abs=0.01)


def test_far_stripes_are_painted_as_their_mean():
    """Beyond three periods per pixel, stripes are a line with 3/4.33 of its paint."""
    shape = (80, 120)
    coverage = np.zeros((4, shape[0], shape[1] + 2), np.float32)
    lens, frustum = lens_of(shape=shape), frustum_of(shape=shape)
    layer = GroundLayer(coverage, np.zeros((3, 16)), np.zeros((2, 20)), np.zeros((2, 8)), frustum)
    solid = coverage.copy()
    # Z²/(f·h) = 3·4.33 m at Z = 36 m; from 40 m on no stripe is separate.
    for striped, target in ((1.0, coverage), (0.0, solid)):
        layer = layer._replace(coverage=target)
        lines = line_records(np.array([(40.0, 0.0, 90.0, 0.0, 0.0, striped)]))
        add_lines(layer, lens, lines.view(np.recarray), LOOK)
    ratio = np.cumsum(coverage[PAINT], axis=1).sum() / np.cumsum(solid[PAINT], axis=1).sum()
    assert ratio == pytest.approx(3 / 4.33, rel=1e-3)


@compiled_only
@pytest.mark.parametrize("roll", [0.0, 0.1])
@pytest.mark.parametrize("pitch", [-0.3, 0.0, 0.2])
@pytest.mark.parametrize("turn", [0.3, 2.0, 4.4])
def test_what_is_outside_the_view_is_left_out(turn, pitch, roll):
    """A ring has asphalt and stripes left of, right of, above and below a view: they add nothing to it."""
    road, lane = ring_road(kind=STRIPED)
    geometry, (x, y) = road_geometry(road), lane.position(40.0 * turn, 0.5)
    pose = {"x": x, "y": y, "yaw": lane.heading_at(40.0 * turn) + 0.2, "pitch": pitch, "roll": roll}
    everywhere = record(FRUSTUM, tangent=-1.0, near=-np.inf, far=np.inf)
    sums = []
    for frustum in (everywhere, frustum_of(**pose)):
        coverage = np.zeros((4, 80, 122), np.float32)
        layer = GroundLayer(coverage, np.zeros((3, 16)), np.zeros((2, 20)), np.zeros((2, 8)), frustum)
        add_road(layer, lens_of(**pose), geometry.surface.view(np.recarray))
        add_lines(layer, lens_of(**pose), geometry.lines.view(np.recarray), LOOK)
        sums.append(np.cumsum(coverage, axis=2)[:, :, :120])
    assert sums[0][ROAD].max() > 0.99
    assert sums[0][PAINT].max() > 0.5
    np.testing.assert_allclose(sums[1], sums[0], atol=3e-4)


@compiled_only
@pytest.mark.parametrize("pitch", [-1.2, -0.5, 0.0])
def test_lines_and_quads_at_the_border_of_the_view_are_kept(pitch):
    """One after the other, in all directions from the lens, most of them partly in the view."""
    pose = {"z": 3.0, "pitch": pitch, "roll": 0.05, "yaw": 0.4}
    everywhere, rng = record(FRUSTUM, tangent=-1.0, near=-np.inf, far=np.inf), np.random.default_rng(5)
    shown = 0
    for _ in range(300):
        x, y, turn = *rng.uniform(-6.0, 12.0, 2), rng.uniform(-pi, pi)
        ahead, aside = (
            rng.uniform(0.1, 8.0) * np.array([cos(turn), sin(turn)]),
            np.array([-sin(turn), cos(turn)]),
        )
        start = np.array([x, y])
        line = line_records(np.array([[*start, *(start + ahead), 0.0, 0.0]])).view(np.recarray)
        corners = start - aside, start + aside, start + ahead + aside, start + ahead - aside
        quad = quad_records(np.concatenate(corners)[None]).view(np.recarray)
        sums = []
        for frustum in (everywhere, frustum_of(**pose)):
            coverage = np.zeros((4, 80, 122), np.float32)
            layer = GroundLayer(coverage, np.zeros((3, 16)), np.zeros((2, 20)), np.zeros((2, 8)), frustum)
            add_road(layer, lens_of(**pose), quad)
            add_lines(layer, lens_of(**pose), line, LOOK)
            sums.append(np.cumsum(coverage, axis=2)[:, :, :120])
        shown += sums[0][PAINT].max() > 0.01
        np.testing.assert_allclose(sums[1], sums[0], atol=1e-3)
    assert 20 < shown < 280
