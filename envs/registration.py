"""Registration of the environments with Gymnasium, and of the user's scenario families."""

import inspect
from collections.abc import Callable, Iterable
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator

from lgmd_gym.aliases import Arguments, Config, Values
from lgmd_gym.envs.families import FAMILIES, make_scenario
from lgmd_gym.envs.families.data import scenario_from_data
from lgmd_gym.envs.families.family import Family
from lgmd_gym.envs.families.family import family as add_family
from lgmd_gym.errors import check_keys, check_known, check_text, shown, unknown_name

if TYPE_CHECKING:
    from lgmd_gym.camera import Scene
    from lgmd_gym.envs.attention import Attention
    from lgmd_gym.envs.episode_source import EpisodeSource
    from lgmd_gym.envs.families.scenario import Scenario
    from lgmd_gym.neuron import NeuronSpec
    from lgmd_gym.sensing.channel import ChannelSpec

RANDOM = "RandomBraking"
SCENARIO = "Scenario"
"""The id `LGMD/Scenario-v0`, whose argument `scenario` is a scenario as data."""
_OTHERS = (
    *("camera", "neuron", "params", "fps", "include_frame", "include_base", "trace", "config"),
    "render_mode",
)
LEVEL_ARGUMENTS = (
    "split",
    "start_level",
    "num_levels",
    "weathers",
    "world",
    "road",
    "families",
    "mount_heights",
    "decelerations",
    "sensor_errors",
)
"""Arguments of `RandomLevels`."""
APPEARANCE = ("world", "weather", "road", "scene")
"""Arguments that set how a scenario looks."""
SCENARIO_ARGUMENT = "scenario"


class RandomTask(NamedTuple):
    """An id of random levels."""

    summary: str  # one sentence on its levels
    arguments: Arguments  # default arguments that differ from those of `RandomLevels`


# The non-threats have cars ahead, beside or none: no pedestrian, no mark on the road, no object at the path.
_EASY_FAMILIES = (
    *("CCRs", "CCRm", "CCRb"),
    *("EmptyRoad", "Following", "AdjacentPass", "Overtaken", "CutOut"),
)
RANDOM_TASKS = {
    RANDOM: RandomTask(
        "A random level per episode: 43 families, all worlds of the split and all weathers.", {}
    ),
    "RandomBrakingEasy": RandomTask(
        "A random level per episode, for first trainings: cars on a straight and even road in clear weather.",
        {"families": _EASY_FAMILIES, "weathers": ("clear",), "road": "smooth"},
    ),
}
"""Ids `LGMD/<name>-v0` of random levels."""


# Entry points rather than classes, so that registering the ids does not import highway-env.
TRAFFIC_KINDS: dict[str, str] = {
    "highway": "lgmd_gym.envs.traffic.kinds:HighwayTraffic",
    "merge": "lgmd_gym.envs.traffic.kinds:MergeTraffic",
    "two-way": "lgmd_gym.envs.traffic.kinds:TwoWayTraffic",
    "intersection": "lgmd_gym.envs.traffic.kinds:IntersectionTraffic",
    "roundabout": "lgmd_gym.envs.traffic.kinds:RoundaboutTraffic",
}


def env_id(family: str) -> str:
    """Return the Gymnasium id of a scenario family."""
    return f"LGMD/{check_text('family', family)}-v0"


def register_envs() -> None:
    """Register `LGMD/<name>-v0` for every scenario family and random task, and `LGMD/Scenario-v0`.

    A second call has no effect.
    """
    arguments: dict[str, Values] = {name: {"family": name} for name in (*FAMILIES, SCENARIO)}
    for name, task in RANDOM_TASKS.items():
        arguments[name] = {"family": RANDOM, "split": "train", **task.arguments}
    for name, defaults in arguments.items():
        if env_id(name) not in gym.registry:
            gym.register(  # pyright: ignore[reportUnknownMemberType]
                env_id(name),
                entry_point=f"{__name__}:make_braking",
                vector_entry_point="lgmd_gym.engine:BrakingVectorEnv",
                kwargs=defaults,
            )


def register_family(name: str) -> Callable[[Family], Family]:
    """Register an own scenario family and its id `LGMD/<name>-v0`; usable as a decorator.

    The family is a function that returns a `Scenario` with this name as its `family`, or a class with a
    method `scenario()` that does.

    Raises:
        ValueError: If the name is taken, or contains other characters than letters, digits, ".", "_", "-".
    """
    add = add_family(name)

    def register(function: Family) -> Family:
        add(function)
        register_envs()
        return function

    return register


def make_braking(
    family: str,
    camera: "ChannelSpec | None" = "fovea",
    neuron: str = "lgmd",
    params: "NeuronSpec | None" = None,
    fps: float | None = None,
    include_frame: bool = False,
    include_base: bool = False,
    trace: bool = False,
    config: Config | None = None,
    render_mode: str | None = None,
    **arguments: Any,
) -> gym.Env:
    """Return a braking environment inside `LGMDObservation`, or without it for `camera=None`.

    Args:
        family: A scenario family for `BrakingEnv`, "RandomBraking" for random levels, or "Scenario" for a
            scenario given as data.
        camera: See `LGMDObservation`; None for no camera.
        neuron: See `LGMDObservation`.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        config: Configuration of `BrakingEnv`.
        render_mode: None, "rgb_array" or "human".
        **arguments: Arguments of the family in SI units; `world`, the number of the world, 0 to 9,999, or
            "laboratory", by default drawn from the training worlds at each reset; `weather`, see
            `Weather`, or "mixed" for that of the world; `road`, see `Appearance`; `scene`, a mapping of other
            fields of `Scene`, or a `Scene`, whose world, by default the laboratory, is fixed. For
            "RandomBraking", arguments of `RandomLevels`. For "Scenario", `scenario`: a `Scenario`, or plain
            data as in `scenario_from_data`.

    Raises:
        ValueError: If an argument, key or name is unknown, or a value is out of range.
    """
    from lgmd_gym.envs.braking import BrakingEnv

    source = make_source(family, arguments, _OTHERS)
    env = BrakingEnv(source, config=config, render_mode=render_mode)
    return with_camera(env, camera, neuron, params, fps, include_frame, include_base, trace)


def make_source(family: str, arguments: Arguments, others: Iterable[str] = ()) -> "EpisodeSource":
    """Return the source of the episodes of a family.

    Args:
        family: See `make_braking`.
        arguments: See `make_braking`.
        others: Names of the caller's other arguments, which the message for an unknown argument can suggest.

    Raises:
        ValueError: If an argument or name is unknown, or a value is out of range.
    """
    from lgmd_gym.envs.appearance import Appearance
    from lgmd_gym.envs.episode_source import FixedScenario, RandomLevels

    check_keys(f"argument of {family}", arguments, {*_argument_names(family), *others})
    if family == RANDOM:
        return RandomLevels(**arguments)
    chosen = {name: arguments[name] for name in APPEARANCE if name in arguments}
    others = {name: value for name, value in arguments.items() if name not in APPEARANCE}
    return FixedScenario(_scenario(family, others), Appearance.of(**chosen))


def _scenario(family: str, arguments: Arguments) -> "Scenario":
    if family != SCENARIO:
        return make_scenario(family, **arguments)
    if SCENARIO_ARGUMENT not in arguments:
        raise ValueError("LGMD/Scenario-v0 needs the argument scenario, a Scenario or a dict of its fields")
    return scenario_from_data(arguments[SCENARIO_ARGUMENT])


def _argument_names(family: str) -> Iterable[str]:
    if check_text("family", family) == RANDOM:
        return LEVEL_ARGUMENTS
    if family == SCENARIO:
        return SCENARIO_ARGUMENT, *APPEARANCE
    check_known("scenario", family, (*FAMILIES, RANDOM, SCENARIO))
    return *inspect.signature(FAMILIES[family]).parameters, *APPEARANCE


def with_camera(env: gym.Env, camera: "ChannelSpec | None", *observation: Any) -> gym.Env:
    """Return `env` inside `LGMDObservation` with the remaining arguments, or `env` for `camera=None`."""
    if camera is None:
        return env
    from lgmd_gym.wrappers.observation import LGMDObservation

    return LGMDObservation(env, camera, *observation)


def import_families(modules: Iterable[str]) -> None:
    """Import modules that define scenario families, and register the families and their ids.

    Args:
        modules: "MODULE" for a module that calls `register_family`, or "MODULE:NAME" for a function or class
            in it, which is registered under its name. Modules may be in the working directory.

    Raises:
        ValueError: If a module cannot be imported, or defines no such family.
    """
    from lgmd_gym.processes.user_modules import import_user_module

    for text in modules:
        module_name, _, name = check_text("module", text).partition(":")
        module = import_user_module(module_name, f"module {shown(module_name)}")
        if name:
            _register(module, name)
        elif not _families_of(module_name):
            raise ValueError(
                f"module {module_name!r} registers no scenario family; decorate a function with "
                f"@register_family('NAME'), or pass {module_name}:FUNCTION"
            )
    register_envs()


def is_own(family: str) -> bool:
    """Return whether a registered family is defined outside this package."""
    return not _module_of(family).startswith("lgmd_gym.")


def _register(module: ModuleType, name: str) -> None:
    """Register a function or class of a module under its name, unless it is registered."""
    if name in _families_of(module.__name__):
        return
    function = getattr(module, name, None)
    if function is None:
        known = {*_families_of(module.__name__), *(key for key in vars(module) if not key.startswith("_"))}
        raise unknown_name(f"family of module {module.__name__}", name, known)
    if function not in FAMILIES.values():
        register_family(name)(function)


def _families_of(module: str) -> list[str]:
    """Return the families that are defined in a module or, for a package, below it."""
    return [name for name in FAMILIES if f"{_module_of(name)}.".startswith(f"{module}.")]


def _module_of(family: str) -> str:
    return str(getattr(FAMILIES[family], "__module__", ""))


def traffic_id(kind: str) -> str:
    """Return the Gymnasium id of a kind of traffic, `LGMD/Traffic-TwoWay-v0` for "two-way"."""
    return env_id(f"Traffic-{kind.title().replace('-', '')}")


def register_traffic() -> None:
    """Register the id of every kind of traffic; idempotent."""
    for kind in TRAFFIC_KINDS:
        if traffic_id(kind) not in gym.registry:
            arguments = {"kind": kind, "split": "train"}
            gym.register(traffic_id(kind), entry_point=f"{__name__}:make_traffic", kwargs=arguments)  # pyright: ignore[reportUnknownMemberType]


def find_kind(kind: str) -> Any:
    """Return the environment class of a kind of traffic, a subclass of `TrafficEnv`.

    Raises:
        ValueError: If the kind is unknown.
    """
    check_known("kind of traffic", kind, TRAFFIC_KINDS)
    return load_env_creator(TRAFFIC_KINDS[kind])


def make_traffic(
    kind: str,
    camera: "ChannelSpec | None" = "fovea",
    neuron: str = "lgmd",
    params: "NeuronSpec | None" = None,
    fps: float | None = None,
    include_frame: bool = False,
    include_base: bool = False,
    trace: bool = False,
    config: Config | None = None,
    render_mode: str | None = None,
    world: int | str | None = None,
    weather: "str | Values | None" = None,
    road: str | None = None,
    scene: "Scene | Values | None" = None,
    split: str = "train",
    attention: "Attention | Values | str | None" = None,
) -> gym.Env:
    """Return a traffic environment inside `LGMDObservation`, or without it for `camera=None`.

    This is the entry point of the registered ids: prefer `gym.make(traffic_id(kind), ...)`.

    Args:
        kind: A key of `TRAFFIC_KINDS`.
        camera: See `LGMDObservation`; None for no camera.
        neuron: See `LGMDObservation`.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        config: Configuration of `TrafficEnv`.
        render_mode: None, "rgb_array" or "human".
        world: Number of the world, 0 to 9,999, or "laboratory"; None to draw one of the split at each reset.
        weather: Named weather, `lgmd_gym.camera.Weather` or its fields, or "mixed" for that of the world;
            None for clear.
        road: See `lgmd_gym.envs.appearance.Appearance`.
        scene: Mapping of other fields of `lgmd_gym.camera.Scene`, or a `Scene`, whose world, by default the
            laboratory, is fixed.
        split: See `lgmd_gym.envs.appearance.Appearance`.
        attention: "inattentive" for drivers who err, or an `Attention` or its fields; None for attentive
            drivers.

    Raises:
        ValueError: If a kind, key or name is unknown, or a value is out of range.
    """
    from lgmd_gym.envs.appearance import Appearance
    from lgmd_gym.envs.attention import Attention

    env = find_kind(kind)(config=config, render_mode=render_mode)
    env.attention = Attention.make(attention)
    env.appearance = Appearance.of(scene, world=world, weather=weather, road=road, split=split)
    return with_camera(env, camera, neuron, params, fps, include_frame, include_base, trace)
