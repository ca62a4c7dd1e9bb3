"""Guard rails."""

import numpy as np
from highway_env.road.road import RoadNetwork
from support.cameras import ego_camera
from support.roads import add_car, lens_x, straight_env

from lgmd_gym.camera.objects import MODEL_RAIL
from lgmd_gym.camera.road_geometry import road_geometry


def test_rails_run_along_the_outer_edges():
    env = straight_env(lanes=3)
    rail = road_geometry(env.road, rail=True).roadside
    rail = rail[rail["model"] == MODEL_RAIL]
    assert set(np.round(rail["y"], 3)) == {-1.75 - 0.75, 7.0 + 1.75 + 0.75}
    assert len(rail) == 2 * 5200 / 8
    assert np.diff(np.sort(rail["x"])).max() <= 8.001
    assert len(road_geometry(env.road).roadside) == 0


def test_road_without_lanes_has_no_rails():
    env = straight_env()
    env.road.network = RoadNetwork()
    assert len(road_geometry(env.road, rail=True).roadside) == 0


def test_rails_hide_cars_behind_them_only():
    env = straight_env(lanes=1, y=0.0, line_types=False)
    camera = ego_camera("wide", roadside=0.0, texture=0.0, guard_rail=True)
    bare = ego_camera("wide", roadside=0.0, texture=0.0)
    rail = camera.render(env).astype(int) - bare.render(env)
    u, v = np.floor(camera.project([lens_x(env) + 10.0, 2.5, 0.6])).astype(int)
    assert abs(rail[v, u]) > 20
    for y, hidden in ((4.5, True), (1.3, False)):
        car = add_car(env, lens_x(env) + 10.0, y, shade=10, size=(6.0, 1.2, 1.5))
        at = np.array([lens_x(env) + 10.0, min(y + 0.6, 2.5) if hidden else y - 0.6, 0.66])
        u, v = np.floor(camera.project(at)).astype(int)
        change = int(camera.render(env)[v, u]) - int(bare.render(env)[v, u])
        assert (abs(change) > 20) == hidden, (y, change)
        env.road.vehicles.remove(car)


def test_rails_are_fixed_in_the_world():
    env = straight_env(line_types=False)
    camera = ego_camera("wide", roadside=0.0, texture=0.0, guard_rail=True, hfov_deg=90.0)
    env.vehicle.position[0] = 100.0
    first = camera.render(env)
    env.vehicle.position[0] += 4.0  # the distance between posts; only the far end changes
    assert np.abs(camera.render(env).astype(int) - first)[50:].max() < 20
    env.vehicle.position[0] += 2.0
    assert np.abs(camera.render(env).astype(int) - first)[50:].max() > 30
