"""Exact area coverage: anti-aliased edges, smooth looming, steady distant texture."""

import itertools

import numpy as np
import pytest
from support.cameras import ego_camera
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.render.coverage import add_polygon

PLAIN = {"texture": 0.0, "roadside": 0.0, "vehicles": "box"}


def coverage(corners, shape=(24, 32)):
    acc = np.zeros((2, shape[0], shape[1] + 2), np.float32)
    add_polygon(acc, 0, np.array(np.transpose(corners), float), len(corners), 1.0, 0.0)
    return np.cumsum(acc[0, :, : shape[1]], axis=1)


def test_coverage_of_a_pixel_aligned_and_a_shifted_square():
    square = np.array([[4, 4], [4, 8], [9, 8], [9, 4]], float)
    exact = np.zeros((24, 32))
    exact[4:8, 4:9] = 1.0
    assert coverage(square) == pytest.approx(exact, abs=1e-6)
    half = coverage(square + np.array([0.5, 0.25]))
    assert half[5, 4] == pytest.approx(0.5, abs=1e-6)
    assert half[4, 5] == pytest.approx(0.75, abs=1e-6)
    assert half[4, 4] == pytest.approx(0.375, abs=1e-6)


def test_coverage_against_supersampling():
    rng = np.random.default_rng(0)
    for _ in range(20):
        angles = np.sort(rng.uniform(0, 2 * np.pi, 7))
        centre, radius = rng.uniform(0, 30, 2), rng.uniform(1, 16)
        # Running down on the left: anticlockwise on a screen whose v grows downwards.
        corners = centre + radius * np.stack((np.cos(angles), -np.sin(angles)), axis=1)
        n = 16
        v, u = np.mgrid[0 : 24 * n, 0 : 32 * n] / n + 0.5 / n
        inside = np.ones(v.shape, bool)
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            inside &= (b[0] - a[0]) * (v - a[1]) - (b[1] - a[1]) * (u - a[0]) <= 0
        sampled = inside.reshape(24, n, 32, n).mean(axis=(1, 3))
        assert np.abs(coverage(corners) - sampled).max() < 0.06
        assert coverage(corners).sum() == pytest.approx(sampled.sum(), abs=0.3)


def area_in_pixel(corners, row, col):
    """Return the exact area of a polygon in a pixel, clipped side by side."""
    for axis, limit, sign in ((0, col, 1.0), (0, col + 1, -1.0), (1, row, 1.0), (1, row + 1, -1.0)):
        inside = sign * (corners[:, axis] - limit)
        kept = []
        for i, j in zip(range(len(corners)), np.roll(range(len(corners)), -1), strict=True):
            if inside[i] >= 0.0:
                kept.append(corners[i])
            if (inside[i] >= 0.0) != (inside[j] >= 0.0):
                kept.append(corners[i] + inside[i] / (inside[i] - inside[j]) * (corners[j] - corners[i]))
        if len(kept) < 3:
            return 0.0
        corners = np.array(kept)
    after = np.roll(corners, -1, axis=0)
    return 0.5 * abs(np.sum(corners[:, 0] * after[:, 1] - after[:, 0] * corners[:, 1]))


@pytest.mark.parametrize(
    "corners",
    [
        [[3.3, 2.2], [3.1, 5.4], [27.6, 5.7], [27.9, 2.9]],  # a rolled rectangle, wider than a vector
        [[3.3, 2.2], [3.3, 5.4], [12.5, 5.41], [12.5, 2.21]],  # the same within a vector
        [[3.3, 2.2], [3.3, 5.4], [20.5, 5.45], [20.5, 2.25]],  # a little wider than a vector
        [[-5.0, 1.5], [-4.0, 20.0], [39.0, 3.0], [38.0, 1.6]],  # from side to side, seven columns a row
        [[8.0, -3.0], [2.0, 30.0], [31.5, 26.0], [16.01, -2.0]],  # at most one column a row
        [[30.2, 4.0], [24.0, 7.0], [31.99, 9.0], [32.0, 4.1]],  # ends at the last column
        [[0.0, 0.0], [0.0, 24.0], [32.0, 24.0], [32.0, 0.0]],
    ],
)
def test_coverage_is_the_exact_area_in_each_pixel(corners):
    corners = np.array(corners)
    exact = [[area_in_pixel(corners, row, col) for col in range(32)] for row in range(24)]
    assert coverage(corners) == pytest.approx(np.array(exact), abs=2e-6)


def test_polygons_far_outside_the_frame_are_clipped():
    huge = np.array([[-1e7, -1e6], [-1e7, 1e6], [1e7, 1e6], [1e7, -1e6]])
    assert coverage(huge) == pytest.approx(np.ones((24, 32)), abs=1e-5)
    for shift in ([0, -100.0], [0, 100.0], [-1000.0, 0], [1000.0, 0]):
        square = np.array([[4, 4], [4, 8], [9, 8], [9, 4]], float) + shift
        assert coverage(square) == pytest.approx(np.zeros((24, 32)), abs=1e-6)


def box_area_by_grey(dx, lens="standard", gap=15.0):
    """Return the area of a box from its grey, its exact visible area and that of its rear face [px]."""
    env = straight_env(line_types=False)
    camera = ego_camera(lens, **PLAIN, pitch_deg=0.0)
    car = add_car(env, lens_x(env) + gap + 2.0 + dx, 3.5, shade=10, size=(4.0, 1.8, 1.9))
    frame = camera.render(env).astype(float)
    d = gap + dx
    corners = camera.project(
        [[lens_x(env) + d, 3.5 + s * 0.9, z] for s, z in ((-1, 1.9), (1, 1.9), (1, 0.0))]
    )
    area = (corners[1, 0] - corners[0, 0]) * (corners[2, 1] - corners[1, 1])
    env.road.vehicles.remove(car)
    back = camera.render(env).astype(float)
    grey = frame[frame.shape[0] // 2 + 1, frame.shape[1] // 2]
    weight = (frame - back) / (grey - back)
    rows = slice(0, frame.shape[0] // 2 - 6)  # above skyline and shadow, where the background is plain
    top = corners[0, 1]
    exact = (corners[1, 0] - corners[0, 0]) * (frame.shape[0] // 2 - 6 - top)
    return weight[rows].sum(), exact, area


@pytest.mark.parametrize("dx", np.linspace(0.0, 0.6, 7))
def test_grey_of_a_box_is_proportional_to_its_projected_area(dx):
    measured, exact, area = box_area_by_grey(dx, lens="tele", gap=9.0)
    assert exact > 300
    assert abs(measured - exact) < 0.01 * area


def test_edge_moved_by_a_tenth_of_a_pixel_changes_the_frame_by_a_tenth_of_its_contrast():
    env = straight_env(line_types=False)
    camera = ego_camera("standard", **PLAIN)
    car = add_car(env, lens_x(env) + 22.0, 5.0, shade=10, size=(4.0, 1.8, 3.0))
    px = 20.0 / camera.camera.focal_px  # metres across per pixel on the rear face
    rows = slice(32, 38)  # the box against plain sky
    right = 3.5 + 2.4 - 1.0
    car.position[1] = right
    frames = []
    for k in range(11):
        car.position[1] = right + 0.1 * k * px
        frames.append(camera.render(env).astype(float))
    inside = frames[0][35, int(camera.project([lens_x(env) + 20.0, right, 1.4])[0])]
    edge = int(camera.project([lens_x(env) + 20.0, right + 0.9, 1.5])[0])
    zone = (rows, slice(edge - 6, edge + 7))
    contrast = (inside - frames[0][rows, edge + 10]).sum()
    steps = np.diff([frame[zone].sum() for frame in frames])
    assert steps == pytest.approx(np.full(10, 0.1 * contrast), rel=0.1, abs=3.0)


def test_looming_is_smooth():
    """The frame changes by small, even steps while a car approaches by centimetres."""
    env = straight_env(line_types=False)
    camera = ego_camera("fovea", **PLAIN)
    car = add_car(
        env, lens_x(env) + 42.0, 3.5, shade=30, size=(4.0, 1.8, 1.1)
    )  # below the horizon: plain ground behind
    sums = []
    for k in range(60):
        car.position[0] = lens_x(env) + 42.0 - 0.1 * k
        camera.render(env)
        sums.append(camera.light.sum(dtype=np.float64))  # before rounding to bytes
    steps = np.diff(sums)
    # 0.1 m is a twentieth of a pixel per side; the steps grow with 1/distance². The rest comes from the line
    # between box and shadow: two coverages in one pixel are blended as if they were independent.
    trend = np.polyval(np.polyfit(np.arange(59), steps, 2), np.arange(59))
    assert np.all(steps < 0)
    assert np.abs(steps / trend - 1).max() < 0.4


def test_details_of_an_approaching_car_fade_in():
    env = straight_env(line_types=False)
    camera = ego_camera("standard", texture=0.0, roadside=0.0)
    car = add_car(env, 80.0, 3.5, shade=200)
    frames = []
    for k in range(600):
        car.position[0] = 80.0 - 0.1 * k
        frames.append(camera.render(env).astype(float))
    step = np.array([np.abs(b - a).sum() for a, b in itertools.pairwise(frames)])
    spike = step[1:-1] / (0.5 * (step[:-2] + step[2:]) + 60.0)
    assert spike.max() < 1.6


def test_far_markings_fade_and_do_not_flicker():
    """Rows far ahead contain dozens of stripes, whose mean must be steady at 30 m/s.

    Beyond three periods a pixel the stripes are drawn as their mean; at the limit, 3 periods, a box
    filter leaves at most 1/(3·pi) of the fundamental's amplitude, 2/pi·sin(pi·3/4.33) = 0.52: with a line
    0.15 m wide at 39 m (0.54 px) and a contrast of 104 that is 0.054 · 0.54 · 104 · 0.52 < 2 grey levels.
    """
    env = straight_env(speed=30.0)
    camera = ego_camera("wide", texture=0.0, roadside=0.0)
    frames = []
    for k in range(60):
        env.vehicle.position[0] = k * 1.0
        frames.append(camera.render(env).astype(float))
    far = np.array(frames)[:, 46:49, 40:120]
    assert far.std(axis=0).max() < 2.0
    assert np.array(frames)[:, 60:, :].std(axis=0).max() > 20.0  # near markings move
    assert far.mean(axis=0).max() > 112.0  # far markings are visible


def test_far_asphalt_does_not_flicker():
    """One standard deviation of near asphalt is 9 grey levels; a pixel of row 46 covers 74 m by 0.8 m."""
    env = straight_env(lanes=1, width=60.0, line_types=False, speed=30.0)
    camera = ego_camera("wide", roadside=0.0)
    frames = []
    for k in range(60):
        env.vehicle.position[0] = k * 1.0
        frames.append(camera.render(env).astype(float))
    deviation = np.array(frames)[:, 46:, 60:100].std(axis=0).mean(axis=1)
    assert deviation[0] < 2.5
    assert deviation[-10:].mean() > 6.0
    assert deviation[-10:].mean() > 3.0 * deviation[0]
