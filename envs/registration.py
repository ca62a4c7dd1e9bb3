"""The ids `LGMD/<family>-v0`, each registered to a factory that returns the environment already wrapped."""

from typing import Any

import gymnasium as gym

FACTORY = "lgmd_gym.envs.registration:make_observed"
# Named here so that registering imports neither highway-env nor its pandas; a test holds it against FAMILIES.
IDS = (
    "CCRs",
    "CCRm",
    "CCRb",
    "CCCscp",
    "Following",
    "BrakeRelease",
    "AdjacentPass",
    "PassBetween",
    "Overtaken",
    "Oncoming",
    "CutIn",
    "CutOut",
    "EmptyRoad",
    "SteelPlate",
    "BridgeShadow",
    "PedestrianPass",
    "CurveGuardRail",
    "CrossingClears",
    "TurnBeforeOncoming",
    "LeadTurnsOff",
    "CurveObjectOutside",
    "LaneClosure",
)
RANDOM = "RandomBraking"


def env_id(family: str) -> str:
    """Return the Gymnasium id of a scenario family."""
    return f"LGMD/{family}-v0"


def register_envs() -> None:
    """Register every id with Gymnasium; calling it again changes nothing."""
    for family in (*IDS, RANDOM):
        if env_id(family) not in gym.registry:
            gym.register(env_id(family), entry_point=FACTORY, kwargs={"family": family})


def make_observed(
    family: str,
    camera: Any = "fovea",
    params: Any = None,
    fps: float | None = None,
    include_frame: bool = False,
    include_base: bool = False,
    trace: bool = False,
    config: dict[str, Any] | None = None,
    render_mode: str | None = None,
    **arguments: Any,
) -> gym.Env:
    """Return a braking environment inside `LGMDObservation`, or bare for `camera=None`.

    Args:
        family: A name in `FAMILIES` for `BrakingEnv`, or "RandomBraking" for `RandomBrakingEnv`.
        camera: See `LGMDObservation`; plain values, so that an `EnvSpec` survives JSON. None for no eye,
            as for `lgmd_gym.wrappers.vector.LGMDObservation`, which brings one for the whole batch.
        params: See `LGMDObservation`.
        fps: See `LGMDObservation`.
        include_frame: See `LGMDObservation`.
        include_base: See `LGMDObservation`.
        trace: See `LGMDObservation`.
        config: Configuration of `BrakingEnv`.
        render_mode: None, "rgb_array" or "human".
        **arguments: The family's own arguments, in SI units, and `condition`, the light and weather by name,
            laid over the camera: "clear", "night", "fog" or "degraded"; or those of `RandomBrakingEnv`.

    Raises:
        ValueError: For an unknown argument, key or name (the nearest is named), or a value out of its range.
    """
    from lgmd_gym.envs.braking import BrakingEnv
    from lgmd_gym.envs.random_braking import RandomBrakingEnv
    from lgmd_gym.envs.scenarios.catalogue import make_scenario
    from lgmd_gym.envs.scenarios.distribution import CLEAR, check_conditions
    from lgmd_gym.errors import check_keys

    if family == RANDOM:
        check_keys(f"argument of {RANDOM}", arguments, ("split", "start_level", "num_levels", "conditions"))
        env = RandomBrakingEnv(**arguments, config=config, render_mode=render_mode)
    else:
        condition = arguments.pop("condition", "clear")
        check_conditions([condition])
        env = BrakingEnv(make_scenario(family, **arguments), config=config, render_mode=render_mode)
        if condition != CLEAR:  # which would only build the same cameras again
            env.camera_fields["condition"] = condition
    if camera is None:
        return env
    from lgmd_gym.wrappers.observation import LGMDObservation

    return LGMDObservation(
        env,
        camera=camera,
        params=params,
        fps=fps,
        include_frame=include_frame,
        include_base=include_base,
        trace=trace,
    )
