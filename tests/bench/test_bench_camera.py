"""Rendering time: run with `pytest -m bench tests/bench/test_bench_camera.py`."""

import timeit

import numpy as np
import pytest
from support.cameras import ego_camera
from support.roads import add_car, straight_env

from lgmd_gym.camera import WEATHERS

pytestmark = pytest.mark.bench

# (camera, vehicles, median time per frame on one core of the reference machine [µs])
CASES = [("wide", 0, 38), ("wide", 5, 55), ("fovea", 5, 65), ("paper", 5, 165)]
# Fields of `wide`, and the factor by which they may raise the rendering time with 5 vehicles.
OPTIONS = {
    "night": ({"light": "night"}, 1.4),
    "fog": (WEATHERS["fog"], 1.4),
    "guard_rail": ({"guard_rail": True}, 2.6),
    "night_fog": ({"light": "night", "visibility_m": 30.0}, 1.7),
    "road": ({"road": "normal"}, 1.5),  # redraws the sky, and no edge is level
    "shutter": ({"shutter_s": 0.011}, 3.4),  # two sharp images
    "panorama": ({"panorama": "natural"}, 1.4),  # redrawn only when the lens turns
}


def busy_env(vehicles=5):
    env = straight_env()
    for k in range(vehicles):
        add_car(env, 14.0 + 9.0 * k, 3.5 * (k % 3), shade=40 + 40 * k)
    return env


def median_time(function, number):
    """Return the median time of a call [s]."""
    return np.median(timeit.repeat(function, number=number, repeat=9)) / number


@pytest.mark.parametrize(("name", "vehicles", "limit_us"), CASES)
def test_time_per_frame(benchmark, name, vehicles, limit_us):
    env, camera = busy_env(vehicles), ego_camera(name)
    out = camera.render(env)
    benchmark(camera.render, env, out)
    # Twice the limit, as machines differ.
    assert benchmark.stats.stats.median * 1e6 < 2 * limit_us


@pytest.mark.parametrize("name", OPTIONS)
def test_time_added_by_an_option(benchmark, name):
    fields, factor = OPTIONS[name]
    env = busy_env()
    plain, camera = ego_camera("wide"), ego_camera("wide", **fields)
    out = camera.render(env)
    plain.render(env, out)

    def frame(drawn):
        env.steps += 1  # a road moves the lens, and with it the sky
        drawn.render(env, out)

    reference = median_time(lambda: frame(plain), 200)
    benchmark(frame, camera)
    assert benchmark.stats.stats.median < factor * reference
