"""Odd arguments of public constructors and functions: `python tests/fuzz/constructors.py --seconds 120`.

A case is a valid call with one or two arguments replaced by odd values. It must end with a ValueError or
TypeError of one line that contains the value or the name of the argument. If it succeeds, the odd values must
be of the annotated type (no bool or string as a number, no NaN), and the result must work.
"""

import inspect
import math
import os
import re
import signal
import sys
import tempfile
import warnings
from functools import cache, partial
from numbers import Integral, Real
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

import gymnasium as gym
import numpy as np
from support.fuzz import run_cases

import lgmd_gym
from lgmd_gym import agents, benchmark, camera, engine, envs, neuron
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.suite_file import get_suite
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.errors import shown
from lgmd_gym.training import PolicyWrapper, TrainConfig
from lgmd_gym.tuning.objective import Objective
from lgmd_gym.tuning.space import SearchSpace
from lgmd_gym.video import VideoReader, VideoWriter, find_clips, luma
from lgmd_gym.wrappers import LGMDObservation
from lgmd_gym.wrappers.vector import LGMDObservation as VectorObservation

NAMES = {"spec": ["params"], "text": ["agent", "suite"], "paths": ["path", "clip"], "sensors_of": ["agent"]}
NAMES |= {"path": ["policy", "clip", "video", "file"], "family": ["scenario"], "name": ["scenario", "suite"]}
NAMES |= {"fps": ["clip"], "size": ["clip"], "file": ["hyperparameters"], "ego_speed": ["speed"]}
NAMES |= {"agent": ["rule"], "algo": ["algorithm"], "seeds": ["seed"]}  # other names of arguments
LIMIT_S = 20  # time after which a call counts as hanging [s]
VALUES = (
    None, True, False, "", "nix", "1", "[red]", "x" * 5000, "a\nb", "fog", b"", b"1", -1, 0, 1, 2, 7, 1.5,
    -0.5, 1e400, -1e400, math.nan, 10**9, 10**19, 10**400, -(10**400), 10**5000, 1e-320, 1e300, 1j, [], [1],
    [None], ["fovea"], [[]], (), (1, 2), (0, 0), (-1, 4), (10**9, 4), (1.5, 2.5), (8, 8, 8), ("a", "b"), {},
    {"a": 1}, {None: 1}, {"name": "wide"}, {"shape": [8, 8]}, {1, 2}, object(), object, print,
    Path("nodir/x"), np.nan, np.float32(1.5), np.float64(np.nan), np.int64(3), np.uint8(200),
    np.bool_(True), np.array(2.0), np.zeros(0), np.zeros((2, 2)), np.full((8, 8), 2, np.int8),
    np.ones((8, 8), np.bool_), np.ones((90, 160), np.float16), np.array(["a"]), np.array([None, 1], object),
    np.zeros((8, 8), np.complex128), range(3), "birdseye", ["fovea", "fovea"], {"camera": "fovea"},
    {"seed": -1}, slice(3), Ellipsis, NotImplemented, ValueError("x"),
)  # fmt: skip
INFINITE = {"tau_1", "tau_2", "tau_s", "t_f", "t_ffi", "max_spikes", "far_m"}  # where infinity is documented
CONFIG = (
    *("simulation_frequency", "policy_frequency", "throttle", "reward", "action", "observation", "duration"),
    *("max_deceleration", "latency", "dead_time", "build_up", "screen_width", "screen_height", "scaling"),
    *("manual_control", "offscreen_rendering", "real_time_rendering", "centering_position", "nix"),
)


def made(env):
    """Step an environment, and close it."""
    try:
        env.reset(seed=1)
        env.step(env.action_space.sample() if isinstance(env, gym.vector.VectorEnv) else _action(env))
        if env.render_mode == "rgb_array":
            env.render()
    finally:
        env.close()


def _action(env):
    return env.action_space.sample()


def stepped(cell):
    """Step a neuron with two frames."""
    shape = cell.shape if cell.num is None else (cell.num, *cell.shape)
    for level in (0, 100):
        cell.step(np.full(shape, level, np.uint8))
    assert np.isfinite(cell.outputs).all(), cell.outputs


def driven(scenario):
    """Drive a scenario for two decisions."""
    made(envs.BrakingEnv(scenario))


def acted(agent):
    """Let an agent act once."""
    agent.reset(0)


def braking(**arguments):
    """Make an environment with one key of its configuration."""
    return gym.make("LGMD/CCRs-v0", camera=None, config=arguments)


def traffic(**arguments):
    """Make an environment with traffic and one key of its configuration."""
    return gym.make("LGMD/HighwayTraffic-v0", camera=None, config=arguments)


def reset(**arguments):
    """Reset an environment with odd arguments."""
    env = _env()
    env.reset(**arguments)
    return env


def stepped_vector(**arguments):
    """Reset a vector environment with odd arguments."""
    _vector().reset(**arguments)


@cache
def _env():
    return gym.make("LGMD/CCRs-v0", camera={"name": "wide", "shape": [8, 8]})


@cache
def _vector():
    return gym.make_vec("LGMD/CCRs-v0", num_envs=2, camera=None)


def wrapped(wrapper, **arguments):
    """Wrap an environment."""
    return wrapper(gym.make("LGMD/CCRs-v0", camera=None), **arguments)


def viewed(**arguments):
    """Wrap an environment with a view."""
    return lgmd_gym.LGMDView(gym.make("LGMD/CCRs-v0", camera={"name": "wide", "shape": [8, 8]}), **arguments)


def vector(**arguments):
    """Wrap a vector environment."""
    made_envs = gym.make_vec("LGMD/CCRs-v0", num_envs=2, vectorization_mode="sync", camera=None)
    return VectorObservation(made_envs, **arguments)


def case(**arguments):
    """Return the scenario of a case."""
    return Case(**arguments).scenario


def signature_of(function):
    """Return names and annotations of the arguments that can be given by keyword."""
    parameters = inspect.signature(function).parameters.values()
    return {item.name: item.annotation for item in parameters if item.kind not in (2, 4)}


SMALL = {"name": "wide", "shape": [8, 8]}
CAMERA_FIELDS = signature_of(camera.CameraParams)
ENV = {"camera": SMALL, "params": None, "fps": None, "include_frame": False, "include_base": False}
ENV |= {"trace": False, "render_mode": None}
ENV_TYPES = {"render_mode": "str | None"} | signature_of(lgmd_gym.LGMDObservation)
del ENV_TYPES["env"]


@cache
def targets():
    """Return name, function, valid arguments, annotations, and a function of the result."""
    items = []

    def add(name, function, valid, types=None, use=None):
        items.append((name, function, valid, signature_of(function) if types is None else types, use))

    for group in (_add_scenarios, _add_environments, _add_sensors, _add_agents, _add_runs):
        group(add)
    return items


def _add_scenarios(add):
    """Add the functions of scenarios."""
    for family, function in envs.FAMILIES.items():
        add(family, partial(envs.make_scenario, family), {}, signature_of(function), driven)
    actor = envs.Actor(gap=20.0)
    add("Actor", envs.Actor, {"gap": 30.0}, None, lambda made: driven(scenario(actors=(made,))))
    add(
        "Segment",
        envs.Segment,
        {"start": 1.0, "acceleration": -2.0},
        None,
        lambda made: driven(scenario(actors=(envs.Actor(gap=30.0, speed=5.0, profile=(made,)),))),
    )
    add("Bend", envs.Bend, {"length": 20.0}, None, lambda made: driven(scenario(ego_path=(made,))))
    add("RoadPlan", envs.RoadPlan, {}, None, lambda made: driven(scenario(road=made)))
    add(
        "Scenario",
        envs.Scenario,
        {"family": "x", "ego_speed": 10.0, "duration": 5.0, "actors": (actor,)},
        None,
        driven,
    )
    add("make_scenario", envs.make_scenario, {"name": "CCRs"}, {"name": "str"})
    add("env_id", envs.env_id, {"family": "CCRs"})


def _add_environments(add):
    """Add the functions of environments and wrappers."""
    for name, types in (
        ("CCRs", {"lateral_offset": "float | None", "condition": "str"}),
        ("RandomBraking", {"split": "str", "start_level": "int", "num_levels": "int", "conditions": ""}),
    ):
        add(f"gym.make {name}", partial(gym.make, envs.env_id(name)), ENV, ENV_TYPES | types, made)
        more = {"num_envs": "int", "threads": "int", "autoreset_mode": "", "copy": "bool", "config": ""}
        valid = {**ENV, "num_envs": 2}
        valid.pop("render_mode")
        add(
            f"gym.make_vec {name}",
            partial(gym.make_vec, envs.env_id(name)),
            valid,
            ENV_TYPES | types | more,
            made,
        )
    add("config", braking, {}, dict.fromkeys(CONFIG, ""), made)
    add("reward", lambda **reward: braking(reward=reward), {}, signature_of(RewardParams), made)
    add("brake", braking, {}, signature_of(BrakeParams), made)
    add(
        "demands",
        lambda demands: braking(action={"type": "DiscreteDemand", "demands": demands}),
        {"demands": [0.0]},
        {"demands": ""},
        made,
    )
    add("reset", reset, {}, {"seed": "int | None", "options": ""})
    add("reset config", lambda **config: reset(options={"config": config}), {}, dict.fromkeys(CONFIG, ""))
    add("reset vector", stepped_vector, {}, {"seed": "", "options": ""})
    add("reset mask", lambda mask: stepped_vector(options={"reset_mask": mask}), {"mask": None}, {"mask": ""})
    add("BrakingVectorEnv", engine.BrakingVectorEnv, {"family": "CCRs", "camera": SMALL}, None, made)
    add(
        "LGMDObservation",
        partial(wrapped, LGMDObservation),
        {"camera": SMALL},
        _without_env(LGMDObservation),
        made,
    )
    add("LGMDObservation env", LGMDObservation, {"env": None}, {"env": "int"})
    add("vector LGMDObservation", vector, {"camera": SMALL}, _without_env(VectorObservation), made)
    add("LGMDView", viewed, {}, _without_env(lgmd_gym.LGMDView), made)


def _add_sensors(add):
    """Add the functions of neurons and cameras."""
    add("LGMD", lgmd_gym.LGMD, {"shape": (8, 8)}, None, stepped)
    add("LGMD step", lambda frame: lgmd_gym.LGMD((8, 8)).step(frame), {"frame": None}, {"frame": ""})
    add("LGMDParams", lgmd_gym.LGMDParams, {}, None, lambda made: stepped(lgmd_gym.LGMD((8, 8), params=made)))
    add("LGMDParams.make", lgmd_gym.LGMDParams.make, {"spec": {}})
    add("LGMDParams.from_toml", lgmd_gym.LGMDParams.from_toml, {"path": "x"})
    add("danger_zone", neuron.danger_zone, {"shape": (8, 8), "hfov_deg": 40.0})
    add(
        "CameraParams",
        camera.CameraParams,
        {"shape": (8, 8)},
        None,
        lambda made: rendered(camera.EgoCamera(made)),
    )
    add(
        "EgoCamera",
        camera.EgoCamera,
        {"params": None},
        {"params": "", **CAMERA_FIELDS, "condition": "str"},
        None,
    )
    add("BirdsEye", camera.BirdsEye, {"shape": (8, 8)}, None, rendered)
    add("with_condition", camera.with_condition, {"camera": "wide", "condition": "fog"})


def _add_agents(add):
    """Add the functions of agents."""
    for agent in agents.AGENTS.values():
        types = _option_types(agent) | ({"params": "None"} if issubclass(agent, agents.Rule) else {})
        add(agent.name, agent, {}, types, acted)
        add(
            f"string {agent.name}",
            partial(_agent_string, agent.name),
            {},
            dict.fromkeys(agent.options(), ""),
            acted,
        )
    add("make_agent", agents.make_agent, {"text": "no-brake"}, None, acted)
    add("Policy", agents.Policy, {"path": "x"})
    add("register_agent", agents.register_agent, {"agent": agents.NoBrake}, {"agent": "int"})
    add("to_action", agents.to_action, {"demand": 0.0})


def _add_runs(add):
    """Add the functions of runs, trainings and videos."""
    add("RunConfig", benchmark.RunConfig, {}, None, lambda made: made.to_dict())
    add("Executor", benchmark.Executor, {})
    add("run", lambda config: benchmark.run(config), {"config": None}, {"config": "int"})
    add("Case", case, {"name": "a/b", "family": "CCRs", "arguments": ()}, signature_of(Case))
    add("find_suite", find_suite, {"name": "quick"}, {"name": "str"})
    add("get_suite", get_suite, {"text": "quick"})
    add(
        "TrainConfig", TrainConfig, {"algo": "ppo", "demands": (0.0, -1.0)}, None, lambda made: made.to_dict()
    )
    add(
        "TrainConfig.from_hyperparams",
        TrainConfig.from_hyperparams,
        {"algo": "ppo"},
        dict.fromkeys([*signature_of(TrainConfig), *signature_of(TrainConfig.from_hyperparams)], ""),
    )
    add("FeatureConfig", FeatureConfig, {})
    add(
        "PolicyWrapper",
        lambda **features: PolicyWrapper(gym.make("LGMD/CCRs-v0", camera=SMALL), **features),
        {},
        signature_of(FeatureConfig),
        made,
    )
    add("SearchSpace", SearchSpace, {"agent": "spike-threshold"}, None, lambda made: made.defaults())
    add("Objective", Objective, {"split": "train", "levels": 1, "seeds": 0})
    add("VideoReader", VideoReader, {"path": "x"})
    add("VideoWriter", VideoWriter, {"path": "x.mp4", "fps": 30.0})
    add("find_clips", find_clips, {"paths": ["x"]})
    add("luma", luma, {"picture": np.zeros((2, 2, 3), np.uint8)})


def scenario(**arguments):
    """Return a valid scenario with some arguments replaced."""
    return envs.Scenario(**({"family": "x", "ego_speed": 10.0, "duration": 5.0} | arguments))


def rendered(view):
    """Draw a frame."""
    env = _env()
    env.reset(seed=1)
    view.render(env)


def _without_env(wrapper):
    return {name: kind for name, kind in signature_of(wrapper).items() if name != "env"}


def _option_types(agent):
    return {name: type(default).__name__ for name, default in agent.options().items()}


def _agent_string(agent, **options):
    return agents.make_agent(
        agent + ":" + ",".join(f"{name}={_text(value)}" for name, value in options.items())
    )


def acceptable(name, annotation, value):
    """Return whether a value is of the annotated type; True for annotations other than of plain values."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    kinds = set(re.split(r"\s*\|\s*", text))
    if not kinds <= {"float", "int", "bool", "str", "None"} or kinds == {""}:
        return True
    checks = {
        "None": value is None,
        "bool": isinstance(value, bool | np.bool_),
        "str": isinstance(value, str) or (name == "panorama" and isinstance(value, Path)),
        "int": _is_number(value) and value == int(value),
        "float": _is_number(value) or (name in INFINITE and value == math.inf),
    }
    return any(checks[kind] for kind in kinds)


def _is_number(value):
    return (
        isinstance(value, Real)
        and not isinstance(value, bool)
        and (isinstance(value, Integral) or math.isfinite(value))
    )


def check_message(error, changes):
    """Assert that a message has one line and contains one of the changed arguments or values."""
    message = str(error)
    assert len(message.strip().splitlines()) == 1, f"{type(error).__name__}: {message!r}"
    assert len(message) < 600, f"{len(message)} characters: {message[:80]}"
    parts = [part for item in changes.items() for part in _parts(*item)]
    assert any(part in message for part in parts), f"names no argument: {message}"


def _parts(name, value):
    """Yield texts of which a message about an argument contains one: names, and the starts of values."""
    yield from {name, name.replace("_", " "), name.removesuffix("s"), *NAMES.get(name, ())}
    yield shown(value)[:12]
    if isinstance(value, dict | list | tuple):
        for item in value:
            yield shown(item)[:12]


def _text(value):
    try:
        return str(value)
    except ValueError:  # of an integer of more than 4300 digits
        return ""


def draw_case(rng):
    """Return the description and the check of one call."""
    name, function, valid, types, use = targets()[rng.integers(len(targets()))]
    names = [str(item) for item in rng.permutation(list(types))[: rng.choice((1, 1, 1, 2))]]
    changes = {item: VALUES[rng.integers(len(VALUES))] for item in names}

    def check():
        signal.alarm(LIMIT_S)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                warnings.simplefilter("error", RuntimeWarning)
                result = function(**{**valid, **changes})
                for item, value in changes.items():
                    ignored = changes.get("camera", 0) is None  # without a camera
                    assert ignored or acceptable(item, types[item], value), f"{item} accepted"
                if use is not None:
                    use(result)
        except (ValueError, TypeError) as error:
            if type(error).__mro__[1] not in (Exception, ValueError):
                raise
            return check_message(error, changes)
        finally:
            signal.alarm(0)
        return None

    return f"{name}({', '.join(f'{item}={_text(value)[:60]!r}' for item, value in changes.items())})", check


def _hang(*_):
    raise TimeoutError(f"no end within {LIMIT_S} s")


if __name__ == "__main__":
    made(gym.make("LGMD/CCRs-v0", render_mode="rgb_array"))  # compile the kernels without a time limit
    made(gym.make_vec("LGMD/CCRs-v0", num_envs=2, camera=SMALL))
    os.chdir(tempfile.mkdtemp())
    signal.signal(signal.SIGALRM, _hang)
    sys.exit(run_cases(draw_case, __doc__))
