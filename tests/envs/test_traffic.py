"""Traffic environments: highway-env's drivers, the agent's brake, contact, determinism."""

import copy
import subprocess
import sys
from math import cos, inf, pi
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium import spaces
from highway_env.envs.intersection_env import IntersectionEnv
from highway_env.road.regulation import RegulatedRoad
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from support.records import records
from support.traffic import BRAKE, HOLD, BlockedHighway, EmptyHighway, car_states, run_for

from lgmd_gym.envs.dynamics.brake import draw_brake
from lgmd_gym.envs.registration import TRAFFIC_KINDS, find_kind, make_traffic
from lgmd_gym.envs.traffic.cars import TrafficCar
from lgmd_gym.envs.traffic.kernels import CAR, TAU_PURSUIT, contact_time, idm, neighbours, steer
from lgmd_gym.envs.traffic.lanes import LaneTable
from lgmd_gym.envs.traffic.road import TrafficRoad

TESTS = Path(__file__).parents[1]


@pytest.mark.slow
def test_traffic_does_not_depend_on_the_process_or_on_other_environments():
    command = [sys.executable, "-m", "support.traffic"]
    other = subprocess.run(command, cwd=TESTS, capture_output=True, text=True, check=True).stdout
    before = IDMVehicle.DISTANCE_WANTED, IDMVehicle.COMFORT_ACC_MAX, IDMVehicle.COMFORT_ACC_MIN
    try:
        IntersectionEnv()  # changes the class of highway-env's cars
        assert IDMVehicle.DISTANCE_WANTED == 7
        assert sorted(car_states(list(TRAFFIC_KINDS)[::-1])) == sorted(other.splitlines())
    finally:
        IDMVehicle.DISTANCE_WANTED, IDMVehicle.COMFORT_ACC_MAX, IDMVehicle.COMFORT_ACC_MIN = before


def test_seeds_vary_the_traffic():
    env, positions = make_traffic("highway", camera=None), []
    for seed in (0, 1, 0):
        env.reset(seed=seed)
        positions.append(env.road.vehicles[3].position.tolist())
    assert positions[0] == positions[2] != positions[1]


def test_an_intersection_may_begin_without_other_cars():
    """highway-env keeps each of its cars with a probability, and removes those near the ego."""
    env = make_traffic("intersection", camera=None)
    env.reset(seed=0)
    road = env.unwrapped.road
    road.vehicles.clear()
    assert len(road.read()) == len(road.items)


def stock_road(kind, road):
    """Return highway-env's road with copies of the cars of a traffic road."""
    cars = copy.deepcopy(road.vehicles, {id(road): None, id(road.network): road.network})
    road_class = RegulatedRoad if find_kind(kind).regulated else Road
    stock = road_class(road.network, cars, road.objects, neighbour_vehicles_connected_lanes=True)
    for car in cars:
        car.road = stock
    return stock


def lane_changes(road):
    """Return the number of cars that change lanes within a road."""
    return sum(
        car.lane_index[:2] == car.target_lane_index[:2] and car.lane_index != car.target_lane_index
        for car in road.vehicles
    )


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[] if kind in ("highway", "intersection") else [pytest.mark.slow])
        for kind in TRAFFIC_KINDS
    ],
)
def test_cars_move_as_on_a_road_of_highway_env(kind):
    """Positions, lanes, lane changes and yielding of all cars but the ego, over twelve seconds."""
    env = make_traffic(kind, camera=None)
    env.reset(seed=8)
    env.road.vehicles.remove(env.ego)
    road = TrafficRoad(env.road, None, env.regulated)
    for car in road.vehicles:
        car.continues_to_next_lane = True  # as in highway-env
    stock = stock_road(kind, road)
    changes = 0
    for _ in range(360):
        for each in (road, stock):
            each.act()
            each.step(1 / 30)
        changes += lane_changes(road)
        for car, other in zip(road.vehicles, stock.vehicles, strict=True):
            other.speed = max(other.speed, 0.0)  # cars of highway-env can reverse
            assert car.position == pytest.approx(other.position, abs=1e-6)
            assert (car.heading, car.speed) == pytest.approx((other.heading, other.speed), abs=1e-6)
            assert (car.lane_index, car.target_lane_index) == (other.lane_index, other.target_lane_index)
            assert (car.lane, car.target_speed) == (other.lane, other.target_speed)
    assert changes > 0 or kind in ("two-way", "intersection", "roundabout"), "no lane change"


def test_bodies_begin_with_the_ego():
    env = make_traffic("highway", camera=None)
    env.reset(seed=3)
    cars = env.road.vehicles
    cars.insert(2, cars.pop(cars.index(env.ego)))
    bodies, ordered = env.road.bodies(), [env.ego, *(car for car in cars if car is not env.ego)]
    assert np.stack([bodies["x"], bodies["y"]], axis=1).tolist() == [car.position.tolist() for car in ordered]
    for name, attribute in (("speed", "speed"), ("heading", "heading"), ("length", "LENGTH")):
        assert bodies[name].tolist() == [getattr(car, attribute) for car in ordered]


@pytest.mark.parametrize("kind", TRAFFIC_KINDS)
def test_drivers_and_neighbour_searches_equal_highway_env(kind):
    """Neighbours, lanes, IDM accelerations and steering angles equal those of the original methods."""
    env = make_traffic(kind, camera=None)
    env.reset(seed=3)
    road, lanes = env.road, LaneTable(env.road.network)
    for _ in range(6):
        run_for(env, 1)
        cars = road.read()
        along, across = lanes.coordinates(cars)
        ahead = lanes.bends(cars, along, TAU_PURSUIT)
        for i, car in enumerate(road.vehicles):
            assert car.lane_index == RoadNetwork.get_closest_lane_index(
                road.network, car.position, car.heading
            )
            for index in (car.lane_index, car.target_lane_index):
                k = lanes.numbers[index]
                found = neighbours(cars, i, k, lanes.records, lanes.pieces, lanes.offsets, along, across)
                stock = Road.neighbour_vehicles(road, car, index)
                assert [road.items[j] if j >= 0 else None for j in found] == list(stock)
                acceleration = idm(cars[i], cars, i, found[0], lanes.records, along)
                assert acceleration == pytest.approx(IDMVehicle.acceleration(car, car, *stock), rel=1e-9)
                steering = steer(cars[i], lanes.records[k], along[i, k], across[i, k], ahead[i, k])
                assert steering == pytest.approx(IDMVehicle.steering_control(car, index), abs=1e-12)
            assert car.speed >= 0.0


@pytest.mark.parametrize("kind", TRAFFIC_KINDS)
def test_episode_moves_within_its_spaces(kind):
    env = make_traffic(kind, camera=None, config={"duration": 8})
    observation, _ = env.reset(seed=2)
    infos = [env.reset(seed=2)[1], *run_for(env, 20)]
    assert env.observation_space.contains(observation)
    assert env.action_space.contains(HOLD)
    speeds = np.array([info["ego_speed"] for info in infos])
    assert infos[-1]["distance"] == pytest.approx(np.trapezoid(speeds) / 30, rel=2e-3)
    assert infos[-1]["distance"] > 10.0
    assert {info["deceleration"] for info in infos} == {0.0}
    assert all(info["speed"] == info["ego_speed"] >= 0.0 for info in infos)


def test_brake_has_dead_time_build_up_and_limit():
    """From 25 m/s: 1/30 s latency, 0.1 s dead time, 0.2 s ramp, then 9 m/s² to a standstill."""
    env = EmptyHighway()
    env.reset(seed=0)
    ego = env.ego
    ego.target_speed = ego.speed  # the driver does not decelerate
    start, began = ego.speed, ego.travelled
    infos = run_for(env, 6, BRAKE)
    assert [info["deceleration"] for info in infos[:4]] == [0.0] * 4
    assert infos[3]["ego_speed"] == start
    assert infos[9]["deceleration"] == pytest.approx(9.0)
    assert max(info["deceleration"] for info in infos) == pytest.approx(9.0)
    assert infos[-1]["ego_speed"] == 0.0
    ramp = 0.2 * start - 45.0 * 0.2**3 / 6
    after = start - 0.5 * 9.0 * 0.2
    expected = start * (1 / 30 + 0.1) + ramp + after**2 / 18.0
    assert ego.travelled - began == pytest.approx(expected, abs=0.01)
    position = ego.position.copy()
    run_for(env, 2, BRAKE)
    assert ego.position.tolist() == position.tolist()


def test_the_brake_is_that_of_the_world():
    env = make_traffic("highway", camera=None, world=8003, weather="rain")
    _, info = env.reset(seed=0)
    assert info["world"] == 8003
    brake = env.ego.brake
    assert brake == env.brake == draw_brake(8003, wet=True)
    assert brake.max_deceleration < 7.0
    infos = run_for(env, 3, BRAKE)
    assert -env.ego.current_acceleration == pytest.approx(brake.max_deceleration)
    assert max(info["deceleration"] for info in infos) <= brake.max_deceleration + 1e-9
    assert make_traffic("highway", camera=None, world="laboratory").reset(seed=0)[1]["world"] == -1


def test_the_driver_brakes_no_harder_than_the_brake_can():
    env = EmptyHighway({"max_deceleration": 3.0})
    env.reset(seed=0)
    env.road.vehicles.append(TrafficCar(env.road, env.ego.position + np.array([12.0, 0.0]), speed=0.0))
    env.road.vehicles[-1].crashed = True
    infos = run_for(env, 0.4)
    assert min(info["driver_acceleration"] for info in infos) == -3.0


def test_ten_seconds_at_standstill_truncate_the_episode():
    env = EmptyHighway()
    env.reset(seed=0)
    infos = run_for(env, 40, BRAKE)
    moving = sum(info["ego_speed"] >= 0.5 for info in infos)
    assert len(infos) - moving == 10 * 30


def test_driver_accelerates_after_the_brake_is_released():
    env = EmptyHighway()
    env.reset(seed=0)
    run_for(env, 1, BRAKE)
    slow = env.ego.speed
    assert slow < 20.0
    infos = run_for(env, 6, HOLD)
    assert infos[-1]["ego_speed"] > slow + 3.0
    assert infos[-1]["deceleration"] == 0.0


def test_discrete_actions_are_indices_into_the_demands():
    """Index 1 brakes as the demand -0.5 does; a demand above 0 has the effect of 0."""
    config = {"action": {"type": "DiscreteDemand", "demands": [0.5, -0.5]}}
    discrete, continuous = find_kind("merge")(config=config), find_kind("merge")()
    assert discrete.action_space == spaces.Discrete(2)
    for env in (discrete, continuous):
        env.reset(seed=0)
    for index, demand in [(0, 0.0)] * 3 + [(1, -0.5)] * 30:
        one, other = discrete.step(index), continuous.step([demand])
        np.testing.assert_equal(one, other)
    assert other[-1]["deceleration"] > 1.0
    with pytest.raises(ValueError, match=r"action must be an index in \[0, 1\], got 2"):
        discrete.step(2)


def test_demands_above_zero_have_no_effect():
    hold, throttle = EmptyHighway(), EmptyHighway()
    hold.reset(seed=0)
    throttle.reset(seed=0)
    assert run_for(hold, 2, HOLD)[-1] == run_for(throttle, 2, -BRAKE)[-1]


def test_contact_keeps_the_speeds_and_stops_the_road():
    env = BlockedHighway()
    env.reset(seed=0)
    infos = run_for(env, 6)
    last = infos[-1]
    assert last["collision"]
    assert last["side"] == "front"
    assert last["gap"] == pytest.approx(0.0, abs=1e-6)
    assert last["impact_speed"] == last["relative_impact_speed"] == last["ego_speed"]
    # The driver brakes at 6 m/s² after a build-up of 45 m/s³.
    gap = 50.0 - (env.ego.LENGTH + 5.0) / 2
    assert last["impact_speed"] == pytest.approx(
        (25.0**2 - 2 * 6.0 * (gap - 25.0 * 6 / 45 / 2)) ** 0.5, abs=0.3
    )
    position = env.ego.position.copy()
    env.step(HOLD)
    assert env.ego.position.tolist() == position.tolist()
    assert env.ego.speed == last["impact_speed"]


@pytest.mark.parametrize("hz", [15, 30])
@pytest.mark.parametrize("speed", [0.3, 1.0, 3.0])
def test_impact_speed_while_braking_equals_the_closed_form(speed, hz):
    env, deceleration = BlockedHighway(), 9.0
    for part in (0.1, 0.5, 0.9):
        env.reset(seed=0)
        ego, other = env.ego, env.road.vehicles[1]
        ego.speed, ego.current_acceleration = speed, -deceleration
        ego.demand(-1.0)
        ego._delay_line.advance(1.0)
        time = min(1 / hz, speed / deceleration)
        gap = part * (speed * time - deceleration / 2 * time**2)
        other.position[:] = ego.position + np.array([gap + (ego.LENGTH + other.LENGTH) / 2, 0.0])
        env.road.act()
        env.road.step(1 / hz)
        expected = (speed**2 - 2 * deceleration * gap) ** 0.5
        assert env.road.contact.impact_speed == ego.speed == pytest.approx(expected, abs=0.01 / 3.6)
        assert ego.travelled == pytest.approx(gap, abs=1e-4)


def test_turn_within_a_step_belongs_to_the_contact():
    """A corner at 45° reaches 2.83 m ahead, a side 2 m: a car at 3.25 m is touched amid a turn."""
    ego = {"length": 4.0, "width": 4.0}
    before = records(CAR, ego, {"x": 5.25, "length": 4.0, "width": 4.0})
    after = records(CAR, ego | {"heading": pi / 2, "x": 1.0}, {"x": 5.25, "length": 4.0, "width": 4.0})
    shares = np.linspace(0.0, 1.0, 17)
    time = contact_time(before, after, 0, 1, shares)
    # The corner of the ego is at x = t + 2.83 cos(45° - 90° t).
    assert time + 8**0.5 * cos(pi / 4 - pi / 2 * time) == pytest.approx(3.25, abs=0.01)
    assert contact_time(before, before, 0, 1, shares) == inf


def test_errors_state_the_value_and_suggest_a_fix():
    with pytest.raises(ValueError, match="unknown kind of traffic 'higway'; did you mean 'highway'"):
        make_traffic("higway")
    with pytest.raises(ValueError, match="did you mean 'vehicles_count'"):
        make_traffic("highway", camera=None, config={"vehicle_count": 3})
    with pytest.raises(ValueError, match="does not divide"):
        make_traffic("highway", camera=None, config={"policy_frequency": 7})
    with pytest.raises(ValueError, match="dead_time"):
        make_traffic("highway", camera=None, config={"dead_time": -1.0})
    with pytest.raises(ValueError, match="'DiscreteDemnd'; did you mean 'DiscreteDemand'"):
        make_traffic("highway", camera=None, config={"action": {"type": "DiscreteDemnd"}})
    with pytest.raises(ValueError, match="unknown split of worlds 'tain'; did you mean 'train'"):
        make_traffic("highway", camera=None, split="tain")


def test_videos_play_in_real_time():
    env = gym.make("LGMD/Traffic-Merge-v0", render_mode="rgb_array")
    env.reset(seed=0)
    assert env.metadata["render_fps"] == env.unwrapped.config["policy_frequency"] == 30
    env.close()
