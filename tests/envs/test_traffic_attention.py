"""Drivers who err in traffic: windows, held acceleration, a braking lead, a late follower."""

import copy
from math import inf

import numpy as np
import pytest
from support.traffic import BRAKE, HOLD, EmptyHighway, Following, errors_of, run_for

from lgmd_gym.envs.attention import Attention
from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.traffic.cars import TrafficCar
from lgmd_gym.envs.traffic.driver_errors import add_follower, draw_windows
from lgmd_gym.envs.traffic.kernels import idm

INATTENTIVE = Attention.make("inattentive")
# First windows of seed 20,000, computed by another process.
GLANCE = (2.432376029862719, 6.222691398203156)
BRAKING = (29.227954476672288, 31.79281033172993, 3.7902207506995667)


def states(env, seconds, action=HOLD):
    """Return position and speed of every car, and the info, after each decision."""
    found = []
    for _ in range(round(seconds * 30)):
        _, _, terminated, _, info = env.step(action)
        found.append(([(*car.position.tolist(), float(car.speed)) for car in env.road.vehicles], info))
        if terminated:
            break
    return found


def test_windows_have_the_drawn_lengths_and_a_later_end_only_adds_some():
    def draw(end):
        return draw_windows(np.random.default_rng(3), 10.0, (2.0, 4.0), (3.0, 8.0), end)

    windows = draw(50_000.0)
    assert draw(500.0) == tuple(item for item in windows if item.start < 500.0)
    starts, ends, decelerations = np.array(windows).T
    pauses = starts - np.concatenate(([0.0], ends[:-1]))
    assert (pauses > 0.0).all()
    assert pauses.mean() == pytest.approx(10.0, rel=0.05)
    for values, low, high in ((ends - starts, 2.0, 4.0), (decelerations, 3.0, 8.0)):
        assert (values.min(), values.max()) == (pytest.approx(low, abs=0.01), pytest.approx(high, abs=0.01))
    assert draw_windows(np.random.default_rng(3), inf, (2.0, 4.0), (3.0, 8.0), 500.0) == ()


def test_windows_of_a_seed_depend_neither_on_the_agent_nor_on_the_duration_or_earlier_episodes():
    env = make_traffic("highway", camera=None, attention="inattentive")
    env.reset(seed=20_000)
    errors = env.road.errors
    assert errors.glances[0][:2] == pytest.approx(GLANCE)
    assert errors.brakings[0] == pytest.approx(BRAKING)
    driven = [info["attentive"] for _, info in states(env, 12)]
    env.reset(seed=1)
    env.reset(seed=20_000)
    braked = [info["attentive"] for _, info in states(env, 12, BRAKE)]
    assert env.road.errors.glances == errors.glances
    assert env.road.errors.brakings == errors.brakings
    count = min(len(driven), len(braked))
    assert driven[:count] == braked[:count]
    assert not all(braked)
    short = make_traffic("highway", camera=None, attention="inattentive", config={"duration": 5})
    short.reset(seed=20_000)
    count = len(short.road.errors.glances)
    assert count < len(errors.glances)
    assert short.road.errors.glances == errors.glances[:count]


@pytest.mark.parametrize("kind", TRAFFIC_KINDS)
def test_traffic_is_that_of_attentive_drivers_up_to_the_first_window(kind):
    """Bit for bit, without the car behind the ego and with the reaction of the follower at once."""
    attentive = make_traffic(kind, camera=None)
    plain = Attention(glance_interval=20.0, braking_interval=20.0)
    erring = make_traffic(kind, camera=None, attention=plain)
    attentive.reset(seed=20_003)
    erring.reset(seed=20_003)
    errors = erring.road.errors
    first = min(errors.glances[0].start, errors.brakings[0].start)
    pairs = zip(states(attentive, first), states(erring, first), strict=False)
    assert all(one == other for one, other in pairs)
    assert attentive.road.errors is None


def test_attentive_drivers_are_the_default():
    assert Attention.make(None) == Attention.make("attentive") == Attention()
    assert not Attention().errs
    assert INATTENTIVE.errs
    assert Attention(reaction_time=0.5).errs
    env = make_traffic("merge", camera=None)
    env.reset(seed=0)
    assert env.step(HOLD)[4]["attentive"] is True


def test_lead_that_brakes_while_the_driver_looks_away_is_a_contact_that_a_brake_avoids():
    env = Following()
    env.reset(seed=0)
    infos = run_for(env, 12)
    assert infos[-1]["collision"]
    assert infos[-1]["side"] == "front"
    assert 1.5 < len(infos) / 30 < 5.0
    env.reset(seed=0)
    run_for(env, 2.0)
    infos = run_for(env, 6.0, BRAKE)
    assert not infos[-1]["collision"]
    assert infos[-1]["ego_speed"] == 0.0
    attentive = Following()
    attentive.glances = ()
    attentive.reset(seed=0)
    assert not run_for(attentive, 12)[-1]["collision"]


def test_the_driver_holds_the_acceleration_of_the_start_of_the_window():
    env = Following()
    env.reset(seed=0)
    infos = [info for _, info in states(env, 3.5)]
    accelerations = np.array([info["driver_acceleration"] for info in infos])
    attentive = np.array([info["attentive"] for info in infos])
    # The info after decision k holds the demand of the step before it, and the attention of the next one.
    assert attentive.tolist() == [k + 1 < 30 for k in range(105)]
    assert (accelerations[30:105] == accelerations[29]).all()
    assert len(set(accelerations[:30].tolist())) == 30


def test_the_lead_brakes_by_the_drawn_deceleration_and_then_drives_on():
    env = Following()
    env.glances = ()
    env.reset(seed=0)
    run_for(env, 1.5)
    before = env.lead.speed
    run_for(env, 1.0)
    assert env.lead.speed == pytest.approx(before - 8.0)
    run_for(env, 2.0)
    assert env.lead.speed == pytest.approx(before - 24.0)
    run_for(env, 1.0)
    assert env.lead.speed > 1.5


def test_a_braking_belongs_to_the_car_that_is_ahead_at_its_start():
    env = Following()
    env.reset(seed=0)
    run_for(env, 1.6)
    env.lead.lane_index = env.lead.target_lane_index = ("0", "1", (env.lead.lane_index[2] + 1) % 3)
    env.lead.position = env.road.network.get_lane(env.lead.lane_index).position(300.0, 0.0)
    speed = env.lead.speed
    run_for(env, 0.5)
    assert env.lead.speed == pytest.approx(speed - 4.0)


@pytest.mark.parametrize(
    ("speed", "held", "expected"),
    [(20.0, 1.5, 1.5), (20.0, -2.0, -2.0), (30.0, 1.5, 0.0), (30.0, -2.0, -2.0), (0.0, 1.5, 0.0)],
)
def test_a_held_pedal_neither_exceeds_the_speed_limit_nor_starts_a_standing_car(speed, held, expected):
    env = EmptyHighway()
    env.reset(seed=0)
    env.ego.speed, env.ego.driver_acceleration = speed, held
    errors = errors_of(glances=((0.0, 3.0),))
    assert errors.hold(env.ego, 30.0, -6.0) == expected
    errors.steps = 90
    assert errors.hold(env.ego, 30.0, -6.0) == -6.0


def late(env, decelerations, **fields):
    """Return the accelerations that a car behind the ego gets for those that its driver decides."""
    errors, cars = errors_of(**fields), env.road.read()
    found = []
    for value in decelerations:
        cars["acceleration"][1] = value
        errors.change_others(cars, env.road.vehicles, -1, 1, 8.5)
        found.append(float(cars["acceleration"][1]))
        errors.steps += 1
    return found


def test_the_follower_lifts_the_throttle_and_brakes_after_the_reaction_time():
    env = Following()
    env.reset(seed=0)
    decided = [-0.5] * 2 + [-4.0] * 20 + [-1.0] + [-5.0] * 3
    expected = [-0.5] * 2 + [-1.0] * 15 + [-4.0] * 5 + [-1.0] + [-1.0] * 3
    assert late(env, decided, reaction_time=0.5) == expected
    assert late(env, [-5.99] * 4 + [-6.0] * 2, reaction_time=0.1) == [-1.0] * 3 + [-5.99] + [-8.5] * 2
    assert late(env, decided) == decided
    env.lead.crashed = True
    assert late(env, decided, reaction_time=0.5) == decided


def test_a_car_starts_behind_the_ego_at_the_distance_of_its_driver():
    env = make_traffic("highway", camera=None, attention=Attention(follower=True))
    plain = make_traffic("highway", camera=None)
    env.reset(seed=20_000)
    plain.reset(seed=20_000)
    follower, count = env.road.vehicles[-1], len(plain.road.vehicles)
    assert len(env.road.vehicles) == count + 1
    assert [car.position.tolist() for car in env.road.vehicles[:count]] == [
        car.position.tolist() for car in plain.road.vehicles
    ]
    assert env.np_random.bit_generator.state["state"] == plain.np_random.bit_generator.state["state"]
    assert 0.4 <= follower.TIME_WANTED <= 1.5
    assert follower.lane_index == env.ego.lane_index
    assert follower.speed == env.ego.speed
    distance = env.ego.position[0] - follower.position[0]
    assert distance == pytest.approx(7.0 + follower.TIME_WANTED * env.ego.speed)
    assert not follower.enable_lane_change


def test_there_is_no_follower_without_room():
    env = make_traffic("highway", camera=None, attention=Attention(follower=True))
    env.reset(seed=20_000)
    road, follower = env.road, env.road.vehicles.pop()
    ego = env.ego
    near = TrafficCar(road, ego.position - np.array([1.9 * 8.0, 0.0]), speed=ego.speed)
    road.vehicles.append(near)
    count = len(road.vehicles)
    add_follower(road, ego, np.random.default_rng(0))
    assert len(road.vehicles) == count
    road.vehicles.remove(near)
    add_follower(road, ego, np.random.default_rng(0))
    assert len(road.vehicles) == count
    assert road.vehicles[-1].TIME_WANTED != follower.TIME_WANTED


def test_errors_are_copied_with_the_environment():
    env = make_traffic("two-way", camera=None, attention="inattentive")
    env.reset(seed=20_001)
    run_for(env, 8)
    twin = copy.deepcopy(env)
    assert [item for item, _ in states(twin, 10)] == [item for item, _ in states(env, 10)]


def test_idm_of_the_follower_is_that_of_highway_env_at_zero_reaction_time():
    env = make_traffic("highway", camera=None, attention=Attention(follower=True))
    env.reset(seed=20_000)
    env.road.act()
    cars, lanes = env.road._records, env.road._lanes
    along, _ = lanes.coordinates(cars)
    index, own = len(env.road.vehicles) - 1, env.road.vehicles.index(env.ego)
    expected = idm(cars[index], cars, index, own, lanes.records, along)
    assert cars["acceleration"][index] == pytest.approx(max(expected, -6.0))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("inatentive", "did you mean 'inattentive'"),
        ({"glance_interva": 5.0}, "did you mean 'glance_interval'"),
        ({"glance_durations": (4.0, 2.0)}, "glance_durations must be in ascending order, got .4.0, 2.0."),
        ({"reaction_time": -1.0}, "attention reaction_time must be in .0, 5. s, got -1.0"),
        ({"decelerations": (3.0,)}, "decelerations must be 2 numbers, got .3.0,."),
        (5, "attention must be a name, Attention or Mapping, got 5"),
    ],
)
def test_invalid_attention_is_refused(value, message):
    with pytest.raises(ValueError, match=message):
        make_traffic("merge", camera=None, attention=value)
