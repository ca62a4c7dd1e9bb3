"""Public constructors and functions with valid arguments, for the fuzzer of odd arguments."""

import inspect
from functools import cache, partial

import gymnasium as gym
import numpy as np

import lgmd_gym
from lgmd_gym import agents, benchmark, camera, engine, envs, neuron
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.suites import find_suite, get_suite
from lgmd_gym.clips import VideoReader, VideoWriter, find_clips, luma
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.training import PolicyWrapper, TrainConfig
from lgmd_gym.tuning.objective import Objective
from lgmd_gym.tuning.space import SearchSpace
from lgmd_gym.wrappers import LGMDObservation

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


def case(**arguments):
    """Return the scenario of a case."""
    return Case(**arguments).scenario


def signature_of(function):
    """Return names and annotations of the arguments that can be given by keyword."""
    parameters = inspect.signature(function).parameters.values()
    return {item.name: item.annotation for item in parameters if item.kind not in (2, 4)}


SMALL = {"name": "wide", "shape": [8, 8]}
ENV = {
    "camera": SMALL,
    "neuron": "lgmd",
    "params": None,
    "fps": None,
    "include_frame": False,
    "include_base": False,
}
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
        ("CCRs", {"lateral_offset": "float | None", "weather": "str", "scene": ""}),
        (
            "RandomBraking",
            {"split": "str", "start_level": "int", "num_levels": "int", "weathers": "", "families": ""},
        ),
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
        "Camera",
        camera.Camera,
        {"shape": (8, 8)},
        None,
        lambda made: rendered(camera.EgoCamera(made)),
    )
    add("Mount", camera.Mount, {}, None, lambda made: rendered(camera.EgoCamera(SMALL, mount=made)))
    add(
        "ImageSensor",
        camera.ImageSensor,
        {},
        None,
        lambda made: rendered(camera.EgoCamera(SMALL, sensor=made)),
    )
    add("Scene", camera.Scene, {}, None, lambda made: rendered(camera.EgoCamera(SMALL, made)))
    add("Weather", camera.Weather, {}, None, lambda made: camera.Scene(weather=made))
    add("Channel", lgmd_gym.Channel, {"camera": SMALL})
    add("EgoCamera", camera.EgoCamera, {"camera": SMALL, "scene": None}, {"camera": "", "scene": ""})
    add("BirdsEye", camera.BirdsEye, {"shape": (8, 8)}, None, rendered)


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
    add("Case", case, {"suite": "a", "family": "CCRs", "variant": "b"}, signature_of(Case))
    add("find_suite", find_suite, {"name": "quick"}, {"name": "str"})
    add("get_suite", get_suite, {"source": "quick"})
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
        agent + ":" + ",".join(f"{name}={argument_text(value)}" for name, value in options.items())
    )


def argument_text(value):
    """Return a value as text; an empty one if Python does not print it."""
    try:
        return str(value)
    except ValueError:  # of an integer of more than 4300 digits
        return ""
