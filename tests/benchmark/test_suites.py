"""The suites against the protocol documents' numbers, and what the bounding agents do in every case."""

import numpy as np
import pytest

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.episode import SERIES, TRUTHS, Episode
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.rows import make_row
from lgmd_gym.benchmark.suites import SUITES, find_case
from lgmd_gym.envs import BrakingEnv
from lgmd_gym.envs.dynamics.units import KMH

THREATS = ("quick", "speeds", "ncap2023", "ncap2026", "r152", "fmvss127", "random")
APPROACH = ("CCRs", "CCRm", "CCRb", "CCCscp")
CASES = [case for suite in SUITES.values() for case in suite.cases]


def drive(case, agent_name, seed=0):
    """Play a case without an eye: the bounding agents need none."""
    env = BrakingEnv(case.scenario)
    agent = make_agent(agent_name)
    _, info = env.reset(seed=seed)
    agent.reset(seed)
    blind = {"spike_frequency": np.zeros(1, np.float32)}
    rows, done = [], False
    while True:
        action = agent.act(blind, info)
        held = info["ego_speed"] == 0.0 and action[0] < 0
        truth = [info[name] for name in TRUTHS]
        rows.append((len(rows) / 30, *truth, 0.0, 0.5, 0.0, 0.0, float(held)))
        if done:
            break
        _, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    series = dict(zip(SERIES, np.array(rows).T, strict=True))
    return Episode(
        series, info["collision"], info["impact_speed"], info["relative_impact_speed"], 1.712, 30.0
    )


@pytest.fixture(scope="module")
def outcomes():
    """Rows of the three bounding agents in every case."""
    rows = {}
    for case in CASES:
        truth = None
        for agent in ("no-brake", "always-brake", "ttc-oracle"):
            episode = drive(case, agent)
            truth = truth or Counterfactual.of(episode)
            rows[case.name, agent] = make_row(agent, case, 0, episode, truth)
    return rows


def test_counts_are_the_documents():
    def count(suite, family, warned=False):
        return sum(c.family == family and c.fcw_driver is warned for c in SUITES[suite].cases)

    assert count("ncap2023", "CCRs") == 45
    assert count("ncap2023", "CCRs", warned=True) == 30
    assert count("ncap2023", "CCRm") == 55
    assert count("ncap2023", "CCRb") == 4
    assert count("ncap2023", "CCCscp") == 30
    assert count("ncap2026", "CCRs") == 5 * 5 + 8 + 2 + 2
    assert count("ncap2026", "CCRs", warned=True) == 3 * 5
    assert count("ncap2026", "CCRm") == 6 * 5 + 2 + 2
    assert count("ncap2026", "CCRb") == 6 * 5 + 2 + 2 + 4
    assert count("r152", "CCRs") == 4
    assert count("r152", "CCRm") == 2
    assert find_case("ncap2023/CCRs/v30/overlap-50").arguments == (("ego_speed", 8.333333), ("overlap", -0.5))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_no_brake_meets_every_threat_and_nothing_else(case, outcomes):
    row = outcomes[case.name, "no-brake"]
    assert row["collision"] is (case.scenario.family in APPROACH)
    assert row["threat"] is row["collision"]
    if row["collision"]:
        assert case.suite in THREATS


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_always_brake_succeeds_nowhere(case, outcomes):
    row = outcomes[case.name, "always-brake"]
    assert not row["avoided"]
    assert row["premature_brake"] if row["threat"] else row["false_activation"]
    assert not row["collision"]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_oracle_avoids_what_can_be_avoided_and_is_quiet_elsewhere(case, outcomes):
    row = outcomes[case.name, "ttc-oracle"]
    if row["threat"]:
        assert row["avoided"]
    else:
        assert not row["false_activation"]
        assert row["peak_deceleration"] == 0.0


@pytest.mark.parametrize(
    "case", [c for c in CASES if c.scenario.family in APPROACH], ids=lambda case: case.name
)
def test_every_approach_starts_at_least_4_s_before_contact(case, outcomes):
    assert outcomes[case.name, "no-brake"]["duration"] > 4.5


@pytest.mark.parametrize("per_cent", [-50, -75, 100, 75, 50])
def test_overlap_of_the_cells(per_cent):
    env = BrakingEnv(find_case(f"ncap2023/CCRs/v30/overlap{per_cent}").scenario)
    env.reset(seed=0)
    ego, target = env.road.vehicles
    offset = ego.position[1] - target.position[1]  # + left
    edge = (ego.WIDTH + target.WIDTH) / 2 - abs(per_cent) / 100 * ego.WIDTH
    assert offset == pytest.approx(0.0 if per_cent == 100 else np.sign(per_cent) * edge)


@pytest.mark.parametrize("per_cent", [0, 25, 50, 75, 100])
def test_impact_locations_of_2026(per_cent):
    env = BrakingEnv(find_case(f"ncap2026/CCRs/v30/location{per_cent}").scenario)
    env.reset(seed=0)
    ego, target = env.road.vehicles
    assert ego.position[1] - target.position[1] == pytest.approx((per_cent / 100 - 0.5) * ego.WIDTH)


def test_braking_lead_of_2026_keeps_a_second():
    env = BrakingEnv(find_case("ncap2026/CCRb/v60/location50").scenario)
    _, info = env.reset(seed=0)
    assert info["thw"] == pytest.approx(1.0)
    while not env.step([0.0])[2]:
        pass
    assert env.road.vehicles[1].acceleration in (0.0, pytest.approx(-4.0))


@pytest.mark.parametrize("target", [20, 40, 60])
@pytest.mark.parametrize("ego", ["from-stop", "v20", "v50"])
def test_crossing_strikes_a_quarter_behind_the_front(ego, target):
    env = BrakingEnv(find_case(f"ncap2023/CCCscp/{ego}/target{target}").scenario)
    env.reset(seed=0)
    done = False
    while not done:
        *_, done, _, info = env.step([0.0])
    car, other = env.road.vehicles
    assert info["collision"]
    front = car.position[0] + car.LENGTH / 2
    assert front == pytest.approx(other.position[0] - other.WIDTH / 2, abs=1e-6)
    # It comes from the left, so its front is at larger y.
    behind_front = (other.position[1] + other.LENGTH / 2) - car.position[1]
    assert behind_front / other.LENGTH == pytest.approx(0.25, abs=0.01)


def overlap_share(ego, other):
    """Share of the ego's width that the other covers, both seen along the ego's heading."""
    dx, dy = other.position - ego.position
    cos, sin = np.cos(ego.heading), np.sin(ego.heading)
    turn = other.heading - ego.heading
    half = (abs(np.sin(turn)) * other.LENGTH + abs(np.cos(turn)) * other.WIDTH) / 2
    side = -dx * sin + dy * cos
    return max(0.0, min(0.9, side + half) - max(-0.9, side - half)) / 1.8


def distance_ahead(ego, other):
    """From the ego's front to the other's nearest corner, along the ego's heading."""
    dx, dy = other.position - ego.position
    turn = other.heading - ego.heading
    half = (abs(np.cos(turn)) * other.LENGTH + abs(np.sin(turn)) * other.WIDTH) / 2
    return dx * np.cos(ego.heading) + dy * np.sin(ego.heading) - half - ego.LENGTH / 2


def watch(case):
    """One record per decision: speed, heading, overlap, distance and closing speed."""
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
    return int(np.argmax(flags))


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_case_1_turn_before_an_oncoming_car(side):
    speed, heading, overlap, ahead, *_ = watch(f"false-reaction/TurnBeforeOncoming/{side}").T
    onset = first(np.abs(heading) > 1e-4)
    assert 28 <= speed[0] <= 30
    assert speed[onset] >= 16
    assert ahead[onset] / (speed[onset] * KMH) <= 2.8
    assert speed[onset:].min() >= 10
    if side == "left":  # a left turn sweeps the ego's front across the other car
        gone = onset + np.flatnonzero(overlap[onset:] > 0)[-1] + 1
        assert ahead[gone] / (speed[gone] * KMH) <= 1.7


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_case_2_lead_turns_off(side):
    speed, heading, overlap, ahead, closing, turned, lead = watch(f"false-reaction/LeadTurnsOff/{side}").T
    onset = first(np.abs(turned) > 1e-4)
    assert speed[0] == pytest.approx(40)
    assert lead[0] == pytest.approx(40)
    assert lead[onset] == pytest.approx(10, abs=0.1)
    assert speed[onset] >= 26
    assert ahead[onset] / closing[onset] <= 4.7
    assert speed[onset:].min() >= 20
    assert np.ptp(speed[onset + 3 :]) < 0.1
    gone = onset + first(overlap[onset:] == 0)
    assert 0 < ahead[gone] / (speed[gone] * KMH) <= 2.5
    assert not heading.any()


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_case_3_car_outside_a_curve(side):
    speed, heading, overlap, ahead, *_ = watch(f"false-reaction/CurveObjectOutside/{side}").T
    entry = first(np.abs(heading) > 1e-6)
    assert speed[0] == pytest.approx(30)
    assert speed[entry] >= 22
    assert overlap[entry] > 0
    assert ahead[entry] / (speed[entry] * KMH) <= 1.6
    gone = entry + first(overlap[entry:] == 0)
    assert speed[entry:gone].min() >= 21
    assert 0 < ahead[gone] / (speed[gone] * KMH) <= 1.1


@pytest.mark.parametrize("side", ["left", "right"])
def test_r152_case_4_lane_closure(side):
    speed, heading, overlap, ahead, *_ = watch(f"false-reaction/LaneClosure/v40/{side}").T
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


@pytest.mark.parametrize("kmh", [60, 80])
def test_pass_between_leaves_its_gap(kmh):
    env = BrakingEnv(find_case(f"false-reaction/PassBetween/v{kmh}").scenario)
    env.reset(seed=0)
    ego, one, other = env.road.vehicles
    assert abs(one.position[1] - other.position[1]) - one.WIDTH == pytest.approx(4.5)
    assert one.position[0] == other.position[0]
    assert one.position[1] + other.position[1] == pytest.approx(2 * ego.position[1])
    assert one.position[0] - one.LENGTH / 2 - ego.position[0] - ego.LENGTH / 2 >= 50


def test_pedestrian_is_passed_at_a_metre():
    env = BrakingEnv(find_case("near-miss/PedestrianPass/v30").scenario)
    env.reset(seed=0)
    ego, walker = env.road.ego, env.road.obstacles[0]
    assert walker.position[1] - walker.WIDTH / 2 - ego.position[1] - 0.9 == pytest.approx(1.0)
    assert walker.speed == pytest.approx(5 * KMH)


@pytest.mark.parametrize("side", ["left", "right"])
def test_crossing_car_clears_in_its_time(side):
    """Post-encroachment time: from the rear leaving the ego's lane to the ego's front arriving."""
    env = BrakingEnv(find_case(f"near-miss/CrossingClears/v40/{side}").scenario)
    env.reset(seed=0)
    ego, other = env.road.vehicles
    sign = -1 if side == "right" else 1
    rear = sign * (other.position[1] - ego.position[1]) - other.LENGTH / 2
    time_left = (1.75 - rear) / other.speed
    arrival = (other.position[0] - other.WIDTH / 2 - ego.position[0] - ego.LENGTH / 2) / ego.speed
    assert arrival - time_left == pytest.approx(1.5)
