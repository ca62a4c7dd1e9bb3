"""Checks of arguments: one line that names the argument and shows the value, whatever it is."""

import gymnasium as gym
import numpy as np
import pytest

import lgmd_gym
from lgmd_gym import agents, benchmark, camera, envs, errors
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.suites import get_suite
from lgmd_gym.clips import VideoWriter, find_clips, luma
from lgmd_gym.engine import BrakingVectorEnv
from lgmd_gym.training import TrainConfig

LONG = 10**5000
NO_NUMBERS = [True, "3", None, 1j, np.array(2.0), np.array([1.0]), b"1", slice(None), np.bool_(True)]
NO_NUMBERS += [float("nan"), np.float32("nan"), float("inf"), 10**400, LONG]


@pytest.mark.parametrize(
    "value", [*NO_NUMBERS, float("nan"), np.float32("nan"), float("inf"), LONG], ids=errors.shown
)
def test_only_finite_numbers_are_numbers(value):
    for check in (errors.check_finite, errors.check_positive, lambda *given: errors.check_whole(*given, 0)):
        with pytest.raises(ValueError, match=r"^speed must be [^\n]*, got [^\n]+$"):
            check("speed", value)


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3.0), np.int64(3), np.uint8(3)])
def test_numbers_of_numpy_are_converted(value):
    assert type(errors.check_finite("n", value)) is float
    assert type(errors.check_whole("n", value, 3, 3)) is int
    assert errors.check_flag("flag", np.bool_(True)) is True


@pytest.mark.parametrize("value", [2, 4, 3.5, 1e300])
def test_whole_numbers_have_bounds(value):
    with pytest.raises(ValueError, match=r"n must be a whole number in \[3, 3\], got"):
        errors.check_whole("n", value, 3, 3)


def test_values_are_shown_in_one_short_line():
    assert errors.shown("a\nb") == r"'a\nb'"
    for value in (np.zeros((50, 50)), "x" * 5000, LONG, ["a"] * 999):
        assert "\n" not in errors.shown(value)
        assert len(errors.shown(value)) < errors.MAX_SHOWN + 20
    for name in ([], {}, np.zeros(3), None, LONG, "x" * 5000):
        with pytest.raises(ValueError, match=r"^unknown colour [^\n]{2,300}$"):
            errors.check_known("colour", name, {"red", "blue"})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: envs.make_scenario("CCRs", ego_speed="3"), "ego_speed must be a number, got '3'"),
        (lambda: envs.make_scenario("CCRs", ego_speed=1e-300), "ego_speed must be >= 0.001 m/s"),
        (lambda: envs.make_scenario("CCRs", beside="no"), "beside must be true or false, got 'no'"),
        (lambda: envs.make_scenario("CCRs", lateral_offset=[]), "lateral_offset must be a number"),
        (lambda: envs.make_scenario("LaneClosure", left=0), "left must be true or false, got 0"),
        (lambda: envs.make_scenario("AdjacentPass", cars=1.5), "cars must be a whole number in"),
        (lambda: envs.make_scenario("SteelPlate", shade=None), "shade must be a number, got None"),
        (lambda: envs.make_scenario([]), "unknown scenario []"),
        (lambda: envs.Actor(gap=3.0, profile=[1]), "profile must be a list of Segment, got [1]"),
        (lambda: envs.RoadPlan(lanes="2"), "lanes must be a number, got '2'"),
        (
            lambda: envs.Scenario(family="x", ego_speed=5.0, duration=1.0, actors="car"),
            "actors must be a list",
        ),
        (lambda: lgmd_gym.LGMD((8, "8")), "shape must be (height, width)"),
        (lambda: lgmd_gym.LGMD((10**9, 8)), "shape must be (height, width), each 1 to 16384 px"),
        (lambda: lgmd_gym.LGMD((8, 8), num=10**9), "num must be a whole number in [1, 33554432]"),
        (lambda: lgmd_gym.LGMD((8, 8), threads=10**9), "threads must be a whole number in [1, 1024]"),
        (lambda: lgmd_gym.LGMD((8, 8), roi=(0, 0, 2.5, 2)), "roi must be 4 integers"),
        (lambda: lgmd_gym.LGMD((8, 8), mask="abc"), "mask must be an array of numbers, got 'abc'"),
        (lambda: lgmd_gym.LGMDParams(n_p=float("nan")), "n_p must be finite, got nan"),
        (lambda: camera.Scene(guard_rail=1), "guard_rail must be true or false, got 1"),
        (lambda: camera.EgoCamera({"name": []}), "camera name must be a string, got []"),
        (lambda: camera.BirdsEye(scaling=True), "scaling must be a number, got True"),
        (lambda: gym.make("LGMD/CCRs-v0", trace="yes"), "trace must be true or false, got 'yes'"),
        (lambda: gym.make("LGMD/CCRs-v0", params=3), "LGMD must be LGMDParams or Mapping, got 3"),
        (lambda: gym.make("LGMD/CCRs-v0", config=[1]), "config must be dict, got [1]"),
        (lambda: gym.make("LGMD/CCRs-v0", config={"throttle": "no"}), "throttle must be true or false"),
        (lambda: gym.make("LGMD/CCRs-v0", config={"screen_width": 10**9}), "screen_width must be a whole"),
        (lambda: gym.make("LGMD/CCRs-v0", config={"policy_frequency": "30"}), "policy_frequency must be a"),
        (lambda: gym.make("LGMD/CCRs-v0", render_mode="nix"), "unknown render mode 'nix'"),
        (lambda: gym.make("LGMD/RandomBraking-v0", num_levels=1.5), "num_levels must be a whole number"),
        (lambda: lgmd_gym.LGMDObservation(None), "env must be a highway-env environment, got None"),
        (lambda: BrakingVectorEnv(10**9, family="CCRs"), "num_envs must be a whole number in [1, 65536]"),
        (lambda: BrakingVectorEnv(1, family="CCRs", threads=10**9), "threads must be a whole number in"),
        (lambda: agents.make_agent(3), "agent must be a string, got 3"),
        (lambda: agents.SpikeThreshold([1]), "params must be SpikeThresholdParams, got [1]"),
        (lambda: agents.register_agent("x"), "agent must be a subclass of BatchAgent, got 'x'"),
        (lambda: agents.make_agent("policy:" + "x" * 999 + ".zip"), "is not a path: File name too long"),
        (lambda: agents.to_action(float("nan")), "demand must be finite, got nan"),
        (lambda: benchmark.RunConfig(agents=None), "agents must be a list of strings, got None"),
        (
            lambda: benchmark.RunConfig(camera=3),
            "camera must be a name, Camera or Mapping, got 3",
        ),
        (lambda: benchmark.Executor(jobs=True), "jobs must be a whole number in [1, 1024], got True"),
        (lambda: Case("a", "CCRs", "b", fcw_driver=1), "fcw_driver must be true or false, got 1"),
        (lambda: get_suite(["quick"]), "suite must be a string, got ['quick']"),
        (lambda: TrainConfig(algo="ppo", demands="x"), "demands must be a list of numbers, got 'x'"),
        (lambda: VideoWriter("x.mp4", fps=float("nan")), "fps must be finite, got nan"),
        (lambda: find_clips(None), "paths must be a list, got None"),
        (lambda: luma(np.zeros((4, 4), np.uint8)), "picture must be uint8 of shape (height, width, 3)"),
    ],
)
def test_odd_arguments_are_refused_in_one_line(call, message):
    with pytest.raises((ValueError, TypeError)) as error:
        call()
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("arguments", [{"seed": True}, {"seed": -1}, {"seed": "a"}, {"options": 3}])
def test_odd_arguments_of_reset_are_refused(arguments):
    env = gym.make("LGMD/CCRs-v0", camera=None)
    (name,) = arguments
    with pytest.raises(ValueError, match=rf"^{name} must be [^\n]*, got"):
        env.reset(**arguments)


def test_small_integers_of_numpy_do_not_overflow():
    assert -envs.Actor(gap=np.uint8(200), heading=np.uint8(2)).heading == -2.0
