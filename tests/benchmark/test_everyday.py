"""The suites everyday-threats and everyday-neighbours, and the bound against closed formulas.

The formulas state when this car's brake avoids a contact; the last-moment oracle must avoid exactly these.
"""

import re
from collections import Counter
from math import inf
from pathlib import Path

import numpy as np
import pytest

from lgmd_gym.agents import make_agent
from lgmd_gym.benchmark.suites import SUITES, find_case
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.families import LEVELS
from lgmd_gym.envs.families.road_users import YIELDING

PREMATURE = 4.0  # [s] before the contact without braking
DECISION = 1 / 30  # [s]
BRAKES = (
    BrakeParams(),
    BrakeParams(max_deceleration=5.0, dead_time=0.25, build_up=0.45),  # the weakest of the worlds
    BrakeParams(max_deceleration=2.5, dead_time=0.25, build_up=0.45),  # weaker than any
)
THREATS = SUITES["everyday-threats"].cases


def play(case, name, brake=None):
    """Return the last info of an episode, its duration and the time of the first demand, inf for none [s]."""
    agent, keys = make_agent(name), ("max_deceleration", "dead_time", "build_up")
    config = agent.config | ({} if brake is None else {key: getattr(brake, key) for key in keys})
    env = BrakingEnv(case.scenario, config=config)
    _, info = env.reset(seed=0)
    agent.reset(0)
    onset, decisions, ended = inf, 0, False
    while not ended:
        action = agent.act({}, info)
        if action[0] < 0.0:
            onset = min(onset, decisions * DECISION)
        *_, terminated, truncated, info = env.step(action)
        decisions, ended = decisions + 1, terminated or truncated
    return info, decisions * DECISION, onset


def stopping_distance(speed, brake):
    """Return the distance from the demand to the standstill [m]: v·(τ + T/2) + v²/(2·a) − a·T²/24."""
    a, build_up = brake.max_deceleration, brake.build_up
    if speed < a * build_up / 2.0:  # at rest during the build-up
        return speed * brake.delay + 2.0 / 3.0 * speed * (2.0 * speed * build_up / a) ** 0.5
    return speed * (brake.delay + build_up / 2) + speed**2 / (2 * a) - a * build_up**2 / 24


def stopping_time(speed, brake):
    """Return the time from the demand to the standstill [s]."""
    a, build_up = brake.max_deceleration, brake.build_up
    if speed < a * build_up / 2.0:
        return brake.delay + (2.0 * speed * build_up / a) ** 0.5
    return brake.delay + build_up / 2 + speed / a


def covered(time, speed, deceleration, build_up):
    """Return the distances of a car that brakes to a standstill, at some times after its onset [m]."""
    ramp = np.clip(time, 0.0, build_up)
    at_ramp = speed * ramp - deceleration * ramp**3 / (6.0 * build_up)
    left = speed - deceleration * build_up / 2.0  # speed after the build-up
    full = np.clip(time - build_up, 0.0, left / deceleration)
    return speed * np.minimum(time, 0.0) + at_ramp + left * full - deceleration * full**2 / 2.0


def keeps_a_gap(case, brake):
    """Return whether braking at the first decision after the onset of a lead car's braking avoids contact."""
    gap, speed = case.argument("headway") * case.speed, case.speed
    time = np.linspace(0.0, 40.0, 400_001)  # after the onset of the lead car [s]
    lead = covered(time, speed, case.argument("deceleration"), case.argument("build_up"))
    ego = covered(time - DECISION - brake.delay, speed, brake.max_deceleration, brake.build_up)
    ego += speed * (DECISION + brake.delay)
    return bool((gap + lead - ego).min() > 0.0)


def required_time(case, brake):
    """Return how long before the contact without braking the brake must be demanded at the latest [s]."""
    speed, target = case.speed, case.scenario.actors[0].speed
    if case.family in ("CutInThreat", "ClosingLead"):
        return stopping_distance(speed - target, brake) / (speed - target)
    if case.family in ("PedestrianTowards", "BicycleTowards", "RollingCar"):
        moved = target * stopping_time(speed, brake)
        time = (stopping_distance(speed, brake) + moved) / (speed + target)
        if (
            time >= YIELDING
        ):  # the target has not begun to brake, and is expected to move until the ego stands
            return time
        # The ego must stand before the place at which the target comes to rest.
        return (stopping_distance(speed, brake) + target / 4.0) / speed
    return stopping_distance(speed, brake) / speed


def avoidable(case, brake):
    """Return whether the formulas say that the contact is avoidable without premature braking."""
    if case.family == "HardBrakingLead":
        return keeps_a_gap(case, brake)
    return required_time(case, brake) <= PREMATURE - 2 * DECISION


def test_numbers_of_cases():
    assert Counter(case.family for case in THREATS) == {
        "CutInThreat": 20, "ClosingLead": 18, "HardBrakingLead": 20, "RollingCar": 6, "PedestrianTowards": 4,
        "BicycleTowards": 4, "StandingPerson": 3, "StandingChild": 3, "LyingPerson": 6, "LowBox": 10,
        "AnimalCrossing": 8, "SecondThreat": 8,
    }  # fmt: skip
    neighbours = Counter(case.family for case in SUITES["everyday-neighbours"].cases)
    assert neighbours == {
        "CutIn": 5, "CutInRecovers": 3, "Following": 4, "BrakeRelease": 4, "AdjacentSlower": 5, "Oncoming": 2,
        "BicyclePass": 2, "RoadsidePerson": 6, "BoxPass": 6, "ManholeCover": 2, "SteelPlate": 1,
        "AnimalClears": 3,
    }  # fmt: skip
    for name in ("everyday-threats", "everyday-neighbours"):
        cases = SUITES[name].cases
        assert len({case.name for case in cases}) == len(cases)
        assert {case.family for case in cases} <= {*LEVELS}
        assert all(case.environment == LEVELS[case.family].family for case in cases)
        assert all(LEVELS[case.family].threat is (name == "everyday-threats") for case in cases)


def test_the_documentation_counts_the_cases():
    page = (Path(__file__).parents[2] / "docs" / "protocols.md").read_text(encoding="utf-8")
    text = page.partition("## Everyday threats")[2]
    rows = re.findall(r"^\| (\w+) \| (\d+) \| [\d–, ]+ \| ", text, re.MULTILINE)
    assert {name: int(number) for name, number in rows} == Counter(case.family for case in THREATS)
    part = text.partition("`everyday-neighbours` has 43 cases")[2].partition("\n\n")[0]
    named = dict(re.findall(r"(\w+)\s(\d+)[,)]", part))
    counted = Counter(case.family for case in SUITES["everyday-neighbours"].cases)
    assert {name: int(number) for name, number in named.items()} == counted


def test_values_of_cases():
    case = find_case("everyday-threats/CutInThreat/v80/slower40-ttc0.8-left")
    assert case.speed == pytest.approx(80 / 3.6, abs=1e-6)
    made = case.scenario
    assert made.actors[0].speed == pytest.approx(40 / 3.6, abs=1e-5)
    lead = find_case("everyday-threats/HardBrakingLead/v80/brake9-headway0.5").scenario.actors[0]
    assert (lead.gap, lead.profile[0].acceleration) == (pytest.approx(40 / 3.6, abs=1e-5), -9.0)
    assert find_case("everyday-threats/LowBox/v50/height0.2").scenario.actors[0].width == 0.6
    assert find_case("everyday-threats/LyingPerson/v70/child").scenario.actors[0].height == 0.2
    sides = [case.argument("left") for case in THREATS if case.family == "CutInThreat"]
    assert Counter(sides) == {True: 10, False: 10}
    animals = [case.argument("side") for case in THREATS if case.family == "AnimalCrossing"]
    assert Counter(animals) == {"left": 4, "right": 4}


def wrong_outcomes(cases, brake):
    """Return the cases in which the bound avoids a contact that the formulas exclude, or the opposite."""
    wrong = []
    for case in cases:
        without, end, _ = play(case, "no-brake", brake)
        assert without["collision"], case.name
        info, _, onset = play(case, "last-moment-oracle", brake)
        # The formula of a braking lead car states when contact is avoided, at any time before it.
        in_time = case.family == "HardBrakingLead" or onset >= end - PREMATURE - DECISION
        if (in_time and not info["collision"]) is not avoidable(case, brake):
            wrong.append((case.name, onset, end))
    return wrong


STATED = [case for case in THREATS if case.family not in ("AnimalCrossing", "SecondThreat")]
BRAKING = [case for case in THREATS if case.family == "HardBrakingLead"]


@pytest.mark.parametrize(
    ("cases", "brake"),
    [
        (STATED, BRAKES[0]),
        (BRAKING, BRAKES[1]),
        (BRAKING, BRAKES[2]),
        pytest.param(STATED, BRAKES[1], marks=pytest.mark.slow),
        pytest.param(STATED, BRAKES[2], marks=pytest.mark.slow),
    ],
)
def test_the_bound_avoids_exactly_what_the_formulas_state(cases, brake):
    assert wrong_outcomes(cases, brake) == []


def test_the_formulas_have_both_outcomes():
    assert [sum(avoidable(case, brake) for case in BRAKING) for brake in BRAKES] == [20, 15, 6]
    assert all(avoidable(case, brake) for case in STATED if case not in BRAKING for brake in BRAKES[:2])


@pytest.mark.parametrize("brake", [BRAKES[0], pytest.param(BRAKES[1], marks=pytest.mark.slow)])
@pytest.mark.parametrize("family", ["AnimalCrossing", "SecondThreat"])
def test_the_bound_avoids_animals_and_second_threats(family, brake):
    """To stop before an animal takes less than 4 s; to let it pass takes less."""
    for case in THREATS:
        if case.family == family:
            without, end, _ = play(case, "no-brake", brake)
            info, _, onset = play(case, "last-moment-oracle", brake)
            assert without["collision"], case.name
            assert not info["collision"], case.name
            assert onset >= end - PREMATURE
            if family == "AnimalCrossing":
                assert onset >= end - required_time(case, brake) - 2 * DECISION


@pytest.mark.parametrize("suite", ["r152", "quick", pytest.param("ncap2023", marks=pytest.mark.slow)])
def test_the_bound_avoids_what_the_ttc_oracle_avoids(suite):
    """In everyday-threats it avoids every contact in the laboratory, see the tests above."""
    for case in SUITES[suite].cases:
        if not play(case, "ttc-oracle")[0]["collision"]:
            assert not play(case, "last-moment-oracle")[0]["collision"], case.name


def test_the_bound_does_not_brake_for_neighbours():
    for name in ("everyday-neighbours", "near-miss"):
        for case in SUITES[name].cases:
            info, _, onset = play(case, "last-moment-oracle")
            assert (info["collision"], onset) == (False, inf), case.name
