"""Braking environments without a camera: scripts, contact, arguments, determinism."""

import copy
from math import inf

import gymnasium as gym
import numpy as np
import pytest

from lgmd_gym.envs import BrakingEnv, make_scenario
from lgmd_gym.envs.dynamics.units import KMH

HOLD, BRAKE = np.array([0.0], np.float32), np.array([-1.0], np.float32)


def run_episode(env, action, seed=0):
    _, info = env.reset(seed=seed)
    infos, rewards = [info], []
    while True:
        _, reward, terminated, truncated, info = env.step(action)
        infos.append(info)
        rewards.append(reward)
        if terminated or truncated:
            return infos, rewards, terminated


@pytest.mark.parametrize("family", ["CCRs", "CCRm", "CCRb"])
def test_approach_ends_in_contact_unless_braked(family):
    env = BrakingEnv(make_scenario(family))
    infos, rewards, terminated = run_episode(env, HOLD)
    assert terminated
    assert infos[-1]["collision"]
    assert infos[-1]["gap"] == pytest.approx(0, abs=1e-9)
    braked, braked_rewards, _ = run_episode(env, BRAKE)
    assert not braked[-1]["collision"]
    assert sum(braked_rewards) > sum(rewards)


@pytest.mark.parametrize("family", ["AdjacentPass", "Following", "EmptyRoad"])
def test_braking_costs_reward_in_non_threats(family):
    env = BrakingEnv(make_scenario(family))
    infos, rewards, _ = run_episode(env, HOLD)
    assert not infos[-1]["collision"]
    assert {info["ttc"] for info in infos} == {inf}
    assert min(rewards) > 0
    braked, braked_rewards, _ = run_episode(env, BRAKE)
    assert sum(braked_rewards) < sum(rewards)
    assert max(info["deceleration"] for info in braked) == pytest.approx(9.0)
    assert braked[-1]["ego_speed"] == 0.0


@pytest.mark.parametrize("kmh", [10, 35, 50, 80])
def test_impact_speed_and_contact_time_are_exact(kmh):
    env = BrakingEnv(make_scenario("CCRs", ego_speed=kmh * KMH))
    infos, _, _ = run_episode(env, HOLD)
    assert infos[0]["ttc"] == pytest.approx(5.0)
    assert infos[-1]["impact_speed"] == pytest.approx(kmh * KMH, abs=0.01 * KMH)
    assert len(infos) - 1 in (150, 151)  # the contact coincides with a decision


@pytest.mark.parametrize("start", [40, 100, 140])
def test_impact_speed_after_late_braking_equals_the_closed_form(start):
    """Delay, linear build-up, then constant deceleration over the remaining gap."""
    speed = 50 * KMH
    env = BrakingEnv(make_scenario("CCRs", ego_speed=speed))
    env.reset(seed=0)
    info = {}
    for step in range(400):
        _, _, terminated, _, info = env.step(BRAKE if step >= start else HOLD)
        if terminated:
            break
    gap = 5 * speed - speed * (start / 30 + 1 / 30 + 0.1)
    ramp_distance, after = speed * 0.2 - 9 * 0.2**2 / 6, speed - 0.9
    remaining = gap - ramp_distance
    if remaining > after**2 / 18:
        assert not info["collision"]
        assert info["gap"] == pytest.approx(remaining - after**2 / 18, abs=0.01)
    elif remaining > 0:
        assert info["impact_speed"] == pytest.approx((after**2 - 18 * remaining) ** 0.5, abs=0.1 * KMH)
    else:
        assert info["collision"]


def test_relative_impact_speed_is_against_the_target():
    infos, _, _ = run_episode(
        BrakingEnv(make_scenario("CCRm", ego_speed=50 * KMH, target_speed=20 * KMH)), HOLD
    )
    assert infos[-1]["relative_impact_speed"] == pytest.approx(30 * KMH)
    assert infos[-1]["impact_speed"] == pytest.approx(50 * KMH)


def test_braking_lead_follows_its_script():
    env = BrakingEnv(make_scenario("CCRb", ego_speed=50 * KMH, gap=40.0, deceleration=6.0))
    infos, _, _ = run_episode(env, HOLD)
    speeds = np.array([info["target_speed"] for info in infos])
    assert speeds[90] == pytest.approx(50 * KMH)
    assert speeds[120] == pytest.approx(50 * KMH - 3.0)  # the ramp of 1 s to 6 m/s²
    assert speeds[150] == pytest.approx(50 * KMH - 9.0)
    assert (np.diff(speeds) <= 1e-9).all()
    assert infos[80]["gap"] == pytest.approx(40.0)


@pytest.mark.parametrize("overlap", [1.0, 0.75, 0.5, -0.5, -1.0])
def test_overlap_is_the_covered_share_of_the_ego(overlap):
    env = BrakingEnv(make_scenario("CCRs", overlap=overlap))
    env.reset(seed=0)
    ego, target = env.road.vehicles
    left = max(ego.position[1] - 0.9, target.position[1] - target.WIDTH / 2)
    right = min(ego.position[1] + 0.9, target.position[1] + target.WIDTH / 2)
    full = target.WIDTH / 1.8 if abs(overlap) == 1 else abs(overlap)
    assert (right - left) / 1.8 == pytest.approx(full)
    if abs(overlap) < 1:  # + is left, y increases to the right
        assert np.sign(target.position[1] - ego.position[1]) == -np.sign(overlap)


def test_undefined_values_are_inf_and_info_is_deterministic():
    env = BrakingEnv(make_scenario("AdjacentPass", lateral_offset=-3.5))
    _, info = env.reset(seed=0)
    undefined = {name for name, value in info.items() if value == inf}
    assert undefined == {
        "gap", "ttc", "thw", "drac", "required_deceleration", "impact_speed", "relative_impact_speed"
    }  # fmt: skip
    assert not any(np.isnan(value) for value in info.values())
    assert "action" not in info  # highway-env adds an unseeded random action
    assert BrakingEnv(make_scenario("EmptyRoad")).reset(seed=0)[1]["target_speed"] == inf


def test_drac_and_required_deceleration_are_undefined_at_contact():
    infos, _, _ = run_episode(BrakingEnv(make_scenario("CCRs")), HOLD)
    assert infos[-1]["collision"]
    assert infos[-1]["drac"] == infos[-1]["required_deceleration"] == inf
    assert all(np.isfinite(info["drac"]) for info in infos[:-1])


def test_episodes_are_reproducible_and_seeds_vary_the_scene():
    first, second = (BrakingEnv(make_scenario("CCRs")) for _ in range(2))
    assert run_episode(first, HOLD, seed=3) == run_episode(second, HOLD, seed=3)
    assert first.road.vehicles[1].shade == second.road.vehicles[1].shade
    start = first.road.vehicles[0].position[0]
    first.reset(seed=4)
    assert first.road.vehicles[0].position[0] != pytest.approx(start)


def test_shade_argument_sets_the_body_grey():
    env = BrakingEnv(make_scenario("CCRs", shade=77))
    env.reset(seed=1)
    assert env.road.vehicles[1].shade == 77


def test_ego_regains_the_scripted_speed_after_braking():
    env = BrakingEnv(make_scenario("EmptyRoad", ego_speed=10.0))
    env.reset(seed=0)
    for _ in range(20):
        env.step(BRAKE)
    slowed = env.vehicle.speed
    assert slowed < 7
    for _ in range(200):
        *_, info = env.step(HOLD)
    assert info["ego_speed"] == pytest.approx(10.0, abs=0.05)


def test_throttle_has_an_effect_only_if_configured():
    speeds = {}
    for throttle in (False, True):
        env = BrakingEnv(make_scenario("EmptyRoad", ego_speed=10.0), config={"throttle": throttle})
        env.reset(seed=0)
        for _ in range(60):
            *_, info = env.step(np.array([1.0]))
        speeds[throttle] = info["ego_speed"]
    assert speeds[False] == 10.0
    assert speeds[True] > 14.0


def test_discrete_action_is_an_index_into_demands():
    config = {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}}
    env = BrakingEnv(make_scenario("EmptyRoad", ego_speed=5.0), config=config)
    assert env.action_space == gym.spaces.Discrete(2)
    env.reset(seed=0)
    ends = [env.step(1)[2] for _ in range(120)]
    assert env.ego.speed == 0.0
    assert ends.index(True) * env.config["policy_frequency"] ** -1 > 2.0  # after the follow-up time


def test_metadata_is_not_shared_between_instances():
    slow = BrakingEnv(make_scenario("EmptyRoad"), config={"policy_frequency": 10})
    fast = BrakingEnv(make_scenario("EmptyRoad"))
    assert (slow.metadata["render_fps"], fast.metadata["render_fps"]) == (10, 30)
    assert "render_fps" not in BrakingEnv.metadata


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: make_scenario("CCRs", ego_speed=50), "50 m/s = 180 km/h.*for 50 km/h pass 13.89"),
        (lambda: make_scenario("CCRs", ego_speed=-3), r"ego_speed must be in \(0, 40\] m/s, got -3"),
        (lambda: make_scenario("CCRs", ego_speed=True), "ego_speed must be a number, got True"),
        (lambda: make_scenario("CCRs", ego_speed=10**400), "ego_speed must be below 1e308"),
        (lambda: make_scenario("CCRs", ego_speed="fast"), "ego_speed must be a number, got 'fast'"),
        (lambda: make_scenario("CCRs", ego_speed=float("nan")), "ego_speed must be finite"),
        (lambda: make_scenario("CCRx"), "unknown scenario 'CCRx'; did you mean 'CCR"),
        (
            lambda: make_scenario("CCRs", speed=5),
            "unknown argument of CCRs 'speed'; did you mean 'ego_speed'",
        ),
        (lambda: make_scenario("CCRs", overlap=1.5), r"overlap must be in \[-1, 1\], got 1.5"),
        (lambda: make_scenario("CCRs", overlap=0.5, lateral_offset=0.0), "pass one"),
        (
            lambda: make_scenario("CCRs", impact_location=2.0),
            r"impact_location must be in \[-0.25, 1.25\], got 2",
        ),
        (lambda: make_scenario("CCRb", gap=20.0, headway=1.0), "pass one"),
        (lambda: make_scenario("CCRm", ego_speed=5.0), "target_speed must be below ego_speed 5"),
        (lambda: make_scenario("AdjacentPass", lateral_offset=1.0), "for a car in the ego's path use CCRs"),
        (lambda: make_scenario("CCRs", shade=300), r"shade must be in \[0, 255\], got 300"),
        (lambda: BrakingEnv(make_scenario("CCRs"), config={"simulation_freq": 60}), "'simulation_frequency'"),
        (lambda: BrakingEnv(make_scenario("CCRs"), config={"policy_frequency": 7}), "7 Hz does not divide"),
        (lambda: BrakingEnv(make_scenario("CCRs"), config={"reward": {"brakes": 1}}), "'brake'"),
        (
            lambda: BrakingEnv(make_scenario("CCRs"), config={"action": {"type": "Discrete"}}),
            "DiscreteDemand",
        ),
        (
            lambda: BrakingEnv(make_scenario("CCRs"), config={"max_deceleration": -9}),
            "max_deceleration must be",
        ),
    ],
)
def test_errors_state_the_value_and_suggest_a_fix(call, words):
    with pytest.raises(ValueError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_nan_action_raises():
    env = BrakingEnv(make_scenario("CCRs"))
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"an action must be a finite number in \[-1, 1\], got nan"):
        env.step(np.array([np.nan]))


def test_deep_copies_are_independent():
    env = BrakingEnv(make_scenario("CCRs"))
    env.reset(seed=0)
    fork = copy.deepcopy(env)
    for _ in range(30):
        fork.step(BRAKE)
    assert env.vehicle.speed == pytest.approx(50 * KMH)
    assert fork.vehicle.speed < 8


@pytest.mark.parametrize("route", ["reset", "configure"])
@pytest.mark.parametrize(
    ("name", "refused"),
    [
        ("CCRs", {"max_deceleration": 2.0, "reward": {"jerk": -1.0}}),
        ("CCRs", {"max_deceleration": -1.0}),
        ("Traffic-Highway", {"max_deceleration": 2.0, "policy_frequency": 7}),
    ],
)
def test_a_refused_configuration_leaves_the_environment_unchanged(name, refused, route):
    env = gym.make(f"LGMD/{name}-v0").unwrapped
    env.reset(seed=0)
    before, config, render_fps = {**vars(env)}, copy.deepcopy(env.config), env.metadata["render_fps"]
    with pytest.raises(ValueError):
        env.configure(refused) if route == "configure" else env.reset(seed=1, options={"config": refused})
    assert (env.config, env.metadata["render_fps"]) == (config, render_fps)
    assert vars(env).keys() == before.keys()
    assert all(value is before[name] for name, value in vars(env).items())


def test_a_refused_action_type_leaves_the_episode_running():
    env = BrakingEnv(make_scenario("CCRs"))
    env.reset(seed=0)
    with pytest.raises(ValueError, match="unknown action type"):
        env.reset(options={"config": {"throttle": True, "action": {"type": "Discrete"}}})
    assert not env.config["throttle"]
    env.step(BRAKE)
