"""Traffic as an environment: highway-env's drivers, the added brake, contact, determinism."""

import subprocess
import sys
from math import pi

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from highway_env.envs.intersection_env import IntersectionEnv
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from support.traffic import BRAKE, HOLD, KIND_NAMES, NearWall, Wall, digest, drive

from lgmd_gym.envs.dynamics.contact import Rectangle
from lgmd_gym.envs.traffic.drivers import CrossingCar, TrafficCar
from lgmd_gym.envs.traffic.geometry import touched_side
from lgmd_gym.envs.traffic.registration import make_traffic


def test_same_seed_same_traffic_in_another_process_and_after_anybody():
    code = "import sys; sys.path.insert(0, 'tests'); from support.traffic import digest; print(*digest(), sep='\\n')"
    there = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    before = IDMVehicle.DISTANCE_WANTED, IDMVehicle.COMFORT_ACC_MAX, IDMVehicle.COMFORT_ACC_MIN
    try:
        IntersectionEnv()  # rewrites the class of all of highway-env's cars
        assert IDMVehicle.DISTANCE_WANTED == 7
        assert digest(KIND_NAMES[::-1])[0].startswith("['roundabout'")
        assert sorted(digest()) == sorted(there.splitlines())
    finally:
        IDMVehicle.DISTANCE_WANTED, IDMVehicle.COMFORT_ACC_MAX, IDMVehicle.COMFORT_ACC_MIN = before


def test_another_seed_is_other_traffic():
    env = make_traffic("highway", camera=None)
    places = [
        env.reset(seed=seed)[0] is not None and env.road.vehicles[3].position.tolist() for seed in (0, 1, 0)
    ]
    assert places[0] == places[2] != places[1]


@pytest.mark.parametrize("kind", KIND_NAMES)
def test_drivers_and_look_ups_are_highway_envs(kind):
    """The short cuts change nothing: neighbours, lanes and IDM's accelerations are the originals'."""
    env = make_traffic(kind, camera=None)
    env.reset(seed=3)
    road, crossing = env.road, kind == "intersection"
    names = ("ACC_MAX", "COMFORT_ACC_MAX", "COMFORT_ACC_MIN", "DISTANCE_WANTED", "TIME_WANTED")
    pinned = CrossingCar if crossing else TrafficCar
    original = type("Original", (IDMVehicle,), {name: getattr(pinned, name) for name in names})
    for _ in range(6):
        drive(env, 1)
        for car in road.vehicles:
            assert car.lane_index == RoadNetwork.get_closest_lane_index(
                road.network, car.position, car.heading
            )
            for lane in (car.lane_index, car.target_lane_index):
                neighbours = road.neighbour_vehicles(car, lane)
                assert neighbours == Road.neighbour_vehicles(road, car, lane)
                if car is not env.ego:
                    stock = original.acceleration(car, car, *neighbours)
                    assert car.acceleration(car, *neighbours) == pytest.approx(stock, rel=1e-9)
                    steering = IDMVehicle.steering_control(car, lane)
                    assert car.steering_control(lane) == pytest.approx(steering, abs=1e-12)
            assert car.speed >= 0.0


@pytest.mark.parametrize("kind", KIND_NAMES)
def test_the_drive_moves_and_tells_what_its_spaces_hold(kind):
    env = make_traffic(kind, camera=None, config={"duration": 8})
    observation, _ = env.reset(seed=2)
    infos = [env.reset(seed=2)[1], *drive(env, 20)]
    assert env.observation_space.contains(observation)
    assert env.action_space.contains(HOLD)
    speeds = np.array([info["ego_speed"] for info in infos])
    assert infos[-1]["distance"] == pytest.approx(np.trapezoid(speeds) / 30, rel=2e-3)
    assert infos[-1]["distance"] > 10.0
    assert {info["deceleration"] for info in infos} == {0.0}
    assert all(info["speed"] == info["ego_speed"] >= 0.0 for info in infos)


@pytest.mark.filterwarnings("ignore")
def test_gymnasium_accepts_it():
    check_env(make_traffic("merge", camera=None), skip_render_check=True)


def test_brake_has_dead_time_build_up_and_limit():
    """From 25 m/s: 1/30 s latency, 0.1 s dead time, 0.2 s ramp, then 9 m/s² to a standstill."""
    env = Wall()
    env.reset(seed=0)
    ego = env.ego
    ego.target_speed = 1e6  # the driver holds 25 m/s: at the wanted speed IDM neither brakes nor goes
    ego.acceleration = lambda **given: 0.0
    start, began = ego.speed, ego.travelled
    infos = drive(env, 6, BRAKE)
    assert [info["deceleration"] for info in infos[:4]] == [0.0] * 4
    assert infos[3]["ego_speed"] == start
    assert infos[9]["deceleration"] == pytest.approx(9.0)
    assert max(info["deceleration"] for info in infos) == pytest.approx(9.0)
    assert infos[-1]["ego_speed"] == 0.0
    ramp = 0.2 * start - 45.0 * 0.2**3 / 6
    after = start - 0.5 * 9.0 * 0.2
    expected = start * (1 / 30 + 0.1) + ramp + after**2 / 18.0
    assert ego.travelled - began == pytest.approx(expected, abs=0.01)
    standing = ego.position.copy()
    drive(env, 2, BRAKE)
    assert ego.position.tolist() == standing.tolist()


def test_standing_for_ten_seconds_ends_the_drive():
    env = Wall()
    env.reset(seed=0)
    infos = drive(env, 40, BRAKE)
    moving = sum(info["ego_speed"] >= 0.5 for info in infos)
    assert len(infos) - moving == 10 * 30


def test_released_the_driver_goes_on():
    env = Wall()
    env.reset(seed=0)
    drive(env, 1, BRAKE)
    slow = env.ego.speed
    assert slow < 20.0
    infos = drive(env, 6, HOLD)
    assert infos[-1]["ego_speed"] > slow + 3.0
    assert infos[-1]["deceleration"] == 0.0


def test_throttle_is_nobodys():
    held, pushed = Wall(), Wall()
    held.reset(seed=0)
    pushed.reset(seed=0)
    assert drive(held, 2, HOLD)[-1] == drive(pushed, 2, -BRAKE)[-1]


def test_contact_keeps_the_speed_and_stops_the_world():
    env = NearWall()
    env.reset(seed=0)
    infos = drive(env, 6)
    last = infos[-1]
    assert last["collision"]
    assert last["side"] == "front"
    assert last["gap"] == pytest.approx(0.0, abs=1e-6)
    assert last["impact_speed"] == last["relative_impact_speed"] == last["ego_speed"]
    # The driver's 6 m/s² over the free way, reached by a ramp of 45 m/s³.
    free = 50.0 - (env.ego.LENGTH + 5.0) / 2
    assert last["impact_speed"] == pytest.approx(
        (25.0**2 - 2 * 6.0 * (free - 25.0 * 6 / 45 / 2)) ** 0.5, abs=0.3
    )
    position = env.ego.position.copy()
    env.step(HOLD)
    assert env.ego.position.tolist() == position.tolist()
    assert env.ego.speed == last["impact_speed"]


EGO = Rectangle(0.0, 0.0, 0.0, 4.3, 1.8)


@pytest.mark.parametrize(
    ("other", "side"),
    [
        (Rectangle(4.65, 0.0, 0.0, 5.0, 2.0), "front"),
        (Rectangle(4.65, 1.7, 0.0, 5.0, 2.0), "front"),
        (Rectangle(-4.65, 0.4, 0.0, 5.0, 2.0), "rear"),
        (Rectangle(0.5, 1.9, 0.0, 5.0, 2.0), "side"),
        (Rectangle(0.2, -3.4, pi / 2, 5.0, 2.0), "side"),
        (Rectangle(3.15, 1.0, pi / 2, 5.0, 2.0), "front"),
    ],
)
def test_where_the_ego_is_touched(other, side):
    assert touched_side(EGO, other) == side
    turned = [Rectangle(-box.x, -box.y, box.heading + pi, box.length, box.width) for box in (EGO, other)]
    assert touched_side(*turned) == side


def test_bad_names_are_refused_with_the_nearest():
    with pytest.raises(ValueError, match="unknown kind of traffic 'higway'; did you mean 'highway'"):
        make_traffic("higway")
    with pytest.raises(ValueError, match="did you mean 'vehicles_count'"):
        make_traffic("highway", camera=None, config={"vehicle_count": 3})
    with pytest.raises(ValueError, match="does not divide"):
        make_traffic("highway", camera=None, config={"policy_frequency": 7})
    with pytest.raises(ValueError, match="dead_time"):
        make_traffic("highway", camera=None, config={"dead_time": -1.0})
