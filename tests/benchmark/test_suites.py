"""The suites against the protocol documents, and the bounding agents in every case."""

from functools import lru_cache

import numpy as np
import pytest

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.metrics import Counterfactual, make_row
from lgmd_gym.benchmark.recorder import GROUND_TRUTH, SERIES
from lgmd_gym.benchmark.suites import SUITES, find_case
from lgmd_gym.envs import BrakingEnv
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.families import LEVELS

WITHOUT_TARGET = ("ncap2023-without-target", "ncap2023-vru-without-target")
SLOW_SUITES = (
    *("ncap2023", "ncap2023-vru", "ncap2026", "ncap2026-extended", "random", "speeds"),
    *WITHOUT_TARGET,
)
NO_THREAT_SUITES = (
    *("false-reaction", "near-miss", "nhtsa-false-activation", "everyday-neighbours"),
    *WITHOUT_TARGET,
)
OTHER_BOUND = ("everyday-threats",)  # where 2 s to contact do not suffice, see test_everyday.py
UNAVOIDABLE = ("CCFhos", "CCFhol")  # by braking: the oncoming car does not stop


@lru_cache(200)  # many cases differ by weather only
def play_without_camera(scenario, agent_name, seed=0):
    """Return an episode of a bounding agent, which needs no camera."""
    env = BrakingEnv(scenario)
    agent = make_agent(agent_name)
    _, info = env.reset(seed=seed)
    agent.reset(seed)
    silent = {"spike_frequency": np.zeros(1, np.float32)}
    rows, done = [], False
    while True:
        action = agent.act(silent, info)
        standstill_hold = info["ego_speed"] == 0.0 and action[0] < 0
        truth = [info[name] for name in GROUND_TRUTH]
        rows.append((len(rows) / 30, *truth, 0.0, 0.5, 0.0, 0.0, float(standstill_hold)))
        if done:
            break
        _, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    series = dict(zip(SERIES, np.array(rows).T, strict=True))
    return Episode(
        series, info["collision"], info["impact_speed"], info["relative_impact_speed"], 1.712, 30.0
    )


def bounding_rows(case):
    """Return the rows of the bounding agents in a case, by agent."""
    rows, counterfactual = {}, None
    for agent in ("no-brake", "always-brake", "ttc-oracle"):
        episode = play_without_camera(case.scenario, agent)
        counterfactual = counterfactual or Counterfactual.of(episode)
        rows[agent] = make_row(agent, case, 0, episode, counterfactual)
    return rows


def violations(case):
    """Return the expectations on the bounding agents that a case does not meet."""
    rows = bounding_rows(case)
    never, always, oracle = rows["no-brake"], rows["always-brake"], rows["ttc-oracle"]
    level = case.family if case.family in LEVELS else case.scenario.family
    threat = LEVELS[level].threat and case.suite not in WITHOUT_TARGET
    avoidable = not threat or case.scenario.family not in UNAVOIDABLE
    fault = "premature_brake" if threat else "false_activation"
    expectations = {
        "no-brake has contact exactly in approaches": never["collision"] is threat,
        "a contact of no-brake is a threat": never["threat"] is threat,
        "the suite is declared to hold threats": not threat or case.suite not in NO_THREAT_SUITES,
        "approaches start more than 4.5 s before contact": not threat or never["duration"] > 4.5,
        "always-brake avoids no contact validly": not always["avoided"],
        "always-brake has contact only with oncoming cars": not always["collision"] or not avoidable,
        "always-brake brakes falsely or prematurely": always[fault]
        or not (threat or case.scenario.ego_speed),
        "the oracle avoids every threat": not (threat and avoidable) or oracle["avoided"],
        # In 2 s the brake takes 9 m/s² times 1.77 s: less latency, dead time and half the build-up.
        "the oracle brakes for oncoming cars": avoidable
        or oracle["impact_speed"] < max(never["impact_speed"] - 15.5, 0.01),
        "the oracle brakes for threats only": threat or oracle["peak_deceleration"] == 0.0,
        "the oracle has no false activation": not oracle["false_activation"],
    }
    if case.suite in ("r152", "fmvss127"):
        met = SUITES[case.suite].limit
        expectations["the oracle meets the limit, always-brake does not"] = met(oracle)[0] > met(always)[0]
    return [f"{case.name}: {expectation}" for expectation, met in expectations.items() if not met]


def test_arguments_of_a_case():
    assert find_case("ncap2023/CCRs/v30/overlap-50").arguments == (("ego_speed", 8.333333), ("overlap", -0.5))
    night = find_case("ncap2026/CPNA/v30/location75-night")
    assert dict(night.arguments) == {"ego_speed": 8.333333, "impact_location": 0.75, "weather": "night"}


@pytest.mark.parametrize(
    "suite",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in SLOW_SUITES else [])
        for name in SUITES
        if name not in OTHER_BOUND
    ],
)
def test_bounding_agents_in_every_case(suite):
    assert [line for case in SUITES[suite].cases for line in violations(case)] == []


@pytest.mark.parametrize("per_cent", [-50, -75, 100, 75, 50])
def test_ncap2023_overlaps(per_cent):
    env = BrakingEnv(find_case(f"ncap2023/CCRs/v30/overlap{per_cent}").scenario)
    env.reset(seed=0)
    ego, target = env.road.vehicles
    offset = ego.position[1] - target.position[1]  # + left
    edge = (ego.WIDTH + target.WIDTH) / 2 - abs(per_cent) / 100 * ego.WIDTH
    assert offset == pytest.approx(0.0 if per_cent == 100 else np.sign(per_cent) * edge)


@pytest.mark.parametrize("per_cent", [0, 25, 50, 75, 100])
def test_ncap2026_impact_locations(per_cent):
    env = BrakingEnv(find_case(f"ncap2026/CCRs/v30/location{per_cent}").scenario)
    env.reset(seed=0)
    ego, target = env.road.vehicles
    assert ego.position[1] - target.position[1] == pytest.approx((per_cent / 100 - 0.5) * ego.WIDTH)


def test_ncap2026_slower_targets_match_the_protocol():
    """Euro NCAP Frontal Collisions v1.1, 3.1: 30 to 80 km/h behind 20 km/h, then 90/30 to 130/70 km/h."""
    above = [(90, 30), (100, 40), (110, 50), (120, 60), (130, 70)]
    expected = [(speed, 20) for speed in range(30, 90, 10)] + above
    for per_cent in (0, 25, 50, 75, 100):
        speeds = []
        for case in SUITES["ncap2026"].cases:
            if case.family == "CCRm" and case.name.endswith(f"/location{per_cent}"):
                made = case.scenario
                speeds.append((round(made.ego_speed / KMH, 4), round(made.actors[0].speed / KMH, 4)))
                assert case.name == f"ncap2026/CCRm/v{speeds[-1][0]:.0f}/location{per_cent}"
        assert speeds == expected


def test_ncap2026_braking_lead_starts_at_a_headway_of_one_second():
    env = BrakingEnv(find_case("ncap2026/CCRb/v60/location50").scenario)
    _, info = env.reset(seed=0)
    assert info["thw"] == pytest.approx(1.0)
    while not env.step([0.0])[2]:
        pass
    assert env.road.vehicles[1].acceleration in (0.0, pytest.approx(-4.0))


@pytest.mark.parametrize("target", [20, 40, 60])
@pytest.mark.parametrize("ego", ["from-stop", "v20", "v50"])
def test_crossing_impact_point_is_a_quarter_behind_the_front(ego, target):
    env = BrakingEnv(find_case(f"ncap2023/CCCscp/{ego}/target{target}").scenario)
    env.reset(seed=0)
    done = False
    while not done:
        *_, done, _, info = env.step([0.0])
    car, other = env.road.vehicles
    assert info["collision"]
    front = car.position[0] + car.LENGTH / 2
    assert front == pytest.approx(other.position[0] - other.WIDTH / 2, abs=1e-6)
    # The target comes from the left, so its front has the larger y.
    behind_front = (other.position[1] + other.LENGTH / 2) - car.position[1]
    assert behind_front / other.LENGTH == pytest.approx(0.25, abs=0.01)


def overlap_share(ego, other):
    """Return the share of the ego's width covered by the other, projected along the ego's heading."""
    dx, dy = other.position - ego.position
    cos, sin = np.cos(ego.heading), np.sin(ego.heading)
    turn = other.heading - ego.heading
    half = (abs(np.sin(turn)) * other.LENGTH + abs(np.cos(turn)) * other.WIDTH) / 2
    side = -dx * sin + dy * cos
    return max(0.0, min(0.9, side + half) - max(-0.9, side - half)) / 1.8


def distance_ahead(ego, other):
    """Return the distance from the ego's front to the other's nearest corner, along the ego's heading."""
    dx, dy = other.position - ego.position
    turn = other.heading - ego.heading
    half = (abs(np.cos(turn)) * other.LENGTH + abs(np.sin(turn)) * other.WIDTH) / 2
    return dx * np.cos(ego.heading) + dy * np.sin(ego.heading) - half - ego.LENGTH / 2


def trajectory(case):
    """Return one line per decision: ego speed and heading, overlap, distance, closing speed, other's
    heading and speed."""
    env = BrakingEnv(find_case(case).scenario)
    env.reset(seed=0)
    ego, other = env.road.ego, env.road.obstacles[0]
    records, done = [], False
    while not done:
        closing = ego.speed - other.speed * np.cos(other.heading - ego.heading)
        overlap, ahead = overlap_share(ego, other), distance_ahead(ego, other)
        records.append(
            (ego.speed / KMH, ego.heading, overlap, ahead, closing, other.heading, other.speed / KMH)
        )
        _, _, terminated, truncated, _ = env.step([0.0])
        done = terminated or truncated
    return np.array(records)


def first(flags):
    """Return the index of the first True."""
    return int(np.argmax(flags))


def distance_to_curve(scenario, actor, corner=(0, 0)):
    """Return how far a point of an actor, by default its centre, is outside the arc of the ego's path [m].

    The result is NaN before and after the arc.
    """
    straight, curve = scenario.ego_path
    radius, side = 1 / abs(curve.curvature), np.sign(curve.curvature)
    ahead = 4.3 / 2 + actor.gap + (1 + corner[0]) * actor.length / 2 - straight.length
    to_centre = radius - side * (actor.lateral_offset + corner[1] * actor.width / 2)
    return np.hypot(ahead, to_centre) - radius if ahead > 0 < to_centre else np.nan


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_false_reaction_1_turn_before_an_oncoming_car(side):
    speed, heading, overlap, ahead, *_ = trajectory(f"false-reaction/TurnBeforeOncoming/{side}").T
    onset = first(np.abs(heading) > 1e-4)
    assert 28 <= speed[0] <= 30
    assert speed[onset] >= 16
    assert ahead[onset] / (speed[onset] * KMH) <= 2.8
    assert speed[onset:].min() >= 10
    if side == "left":  # in a left turn the ego's front crosses the path of the other car
        clear = onset + np.flatnonzero(overlap[onset:] > 0)[-1] + 1
        assert ahead[clear] / (speed[clear] * KMH) <= 1.7


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_false_reaction_2_lead_turns_off(side):
    speed, heading, overlap, ahead, closing, lead_heading, lead = trajectory(
        f"false-reaction/LeadTurnsOff/{side}"
    ).T
    onset = first(np.abs(lead_heading) > 1e-4)
    assert speed[0] == pytest.approx(40)
    assert lead[0] == pytest.approx(40)
    assert lead[onset] == pytest.approx(10, abs=0.1)
    assert speed[onset] >= 26
    assert ahead[onset] / closing[onset] <= 4.7
    assert speed[onset:].min() >= 20
    assert np.ptp(speed[onset + 3 :]) < 0.1
    clear = onset + first(overlap[onset:] == 0)
    assert 0 < ahead[clear] / (speed[clear] * KMH) <= 2.5
    assert not heading.any()


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_false_reaction_3_car_outside_a_curve(side):
    speed, heading, overlap, ahead, *_ = trajectory(f"false-reaction/CurveObjectOutside/{side}").T
    entry = first(np.abs(heading) > 1e-6)
    assert speed[0] == pytest.approx(30)
    assert speed[entry] >= 22
    assert overlap[entry] > 0
    assert ahead[entry] / (speed[entry] * KMH) <= 1.6
    clear = entry + first(overlap[entry:] == 0)
    assert speed[entry:clear].min() >= 21
    assert 0 < ahead[clear] / (speed[clear] * KMH) <= 1.1
    made = find_case(f"false-reaction/CurveObjectOutside/{side}").scenario
    curve = made.ego_path[1]
    assert 1 / abs(curve.curvature) + 3.5 / 2 == pytest.approx(25.0)  # at the outer side of the road
    car, *pipes = made.actors
    assert car.lateral_offset == 0.0  # on the extension of the lane's centre
    beside = [distance_to_curve(made, pipe) for pipe in pipes]
    assert sum(np.isfinite(beside)) > 15
    assert all(
        2.0 < distance < 2.1 for distance in beside if np.isfinite(distance)
    )  # the lane ends at 1.75 m
    corners = [distance_to_curve(made, car, corner) for corner in ((-1, -1), (-1, 1), (1, -1), (1, 1))]
    assert 2.055 + pipes[0].width / 2 < min(corners) < 2.3  # just outside the pipes


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_false_reaction_4_lane_closure(side):
    speed, heading, overlap, ahead, *_ = trajectory(f"false-reaction/LaneClosure/v40/{side}").T
    onset = first(np.abs(heading) > 1e-6)
    assert speed == pytest.approx(40)
    assert overlap[onset] > 0
    assert ahead[onset] / (40 * KMH) <= 4.2
    env = BrakingEnv(find_case(f"false-reaction/LaneClosure/v40/{side}").scenario)
    env.reset(seed=0)
    ego, sign = env.road.ego, env.road.obstacles[0]
    while abs(sign.position[1] - ego.position[1]) < 0.9:  # an offset of 100 % is half the ego's width
        env.step([0.0])
    assert distance_ahead(ego, sign) / (40 * KMH) <= 3.3


@pytest.mark.parametrize(("kmh", "inset"), [(60, 0.0), (80, (1.712 - 1.434 - 0.205) / 2)])
def test_pass_between_has_a_gap_of_4_5_m(kmh, inset):
    """GB 39901-2025 has the gap between the inner sides, 49 CFR 571.127 S9.3 between the front wheels."""
    env = BrakingEnv(find_case(f"false-reaction/PassBetween/v{kmh}").scenario)
    env.reset(seed=0)
    ego, one, other = env.road.vehicles
    assert abs(one.position[1] - other.position[1]) - one.WIDTH + 2 * inset == pytest.approx(4.5)
    assert one.position[0] == other.position[0]
    assert one.position[1] + other.position[1] == pytest.approx(2 * ego.position[1])
    assert one.position[0] - one.LENGTH / 2 - ego.position[0] - ego.LENGTH / 2 >= 50


def test_pedestrian_is_passed_at_1_m():
    env = BrakingEnv(find_case("near-miss/PedestrianPass/v30").scenario)
    env.reset(seed=0)
    ego, walker = env.road.ego, env.road.obstacles[0]
    assert walker.position[1] - walker.WIDTH / 2 - ego.position[1] - 0.9 == pytest.approx(1.0)
    assert walker.speed == pytest.approx(5 * KMH)


@pytest.mark.parametrize("side", ["left", "right"])
def test_crossing_car_clears_1_5_s_ahead(side):
    """The post-encroachment time runs from the rear leaving the ego's lane to the ego's front arriving."""
    env = BrakingEnv(find_case(f"near-miss/CrossingClears/v40/{side}").scenario)
    env.reset(seed=0)
    ego, other = env.road.vehicles
    sign = -1 if side == "right" else 1
    rear = sign * (other.position[1] - ego.position[1]) - other.LENGTH / 2
    time_left = (1.75 - rear) / other.speed
    arrival = (other.position[0] - other.WIDTH / 2 - ego.position[0] - ego.LENGTH / 2) / ego.speed
    assert arrival - time_left == pytest.approx(1.5)
