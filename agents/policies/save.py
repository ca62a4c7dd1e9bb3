"""Cards for models of stable-baselines3 that were trained by hand, with rl-zoo or with its callbacks."""

import inspect
import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.policies.card import PolicyCard, card_file
from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.policies.inputs import NORMALIZER_SUFFIX, save_normalizer
from lgmd_gym.agents.policies.network import describe_network
from lgmd_gym.errors import check_mapping, check_path, shown
from lgmd_gym.processes.extras import missing_extra
from lgmd_gym.processes.files import complete_file

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm

NORMALIZER = f"-vecnormalize{NORMALIZER_SUFFIX}"  # end of the name of the file with the statistics


def save_policy(model: "BaseAlgorithm", file: str | Path, env: Any = None) -> Path:
    """Save a model of stable-baselines3 as an agent: FILE.zip, its card FILE.json, and the normalisation.

    The agent string is "policy:FILE.zip".

    Args:
        model: Trained model with the inputs of `LGMDObservation` or `PolicyWrapper`.
        file: Zip file to write.
        env: Training environment, see `save_card`; that of the model if None.

    Returns:
        Path of the zip file.

    Raises:
        ValueError: If the model has no environment, or a card cannot describe it.
    """
    path = check_path("file", file)
    path = path if path.suffix == ".zip" else path.with_name(f"{path.name}.zip")
    env = model.get_env() if env is None else env
    if env is None:
        raise ValueError("the model has no environment; pass the training environment as env")
    card = replace(save_card(path, env, type(model).__name__.lower()), network=describe_network(model))
    _write(path, card)
    model.save(path)
    return path


def save_card(file: str | Path, env: Any, algo: str, vec_normalize: str | None = None) -> PolicyCard:
    """Write the card FILE.json for a model FILE.zip, for example of `EvalCallback` or rl-zoo.

    Args:
        file: Zip file of the model, which need not exist yet.
        env: Environment like that of the training: one of Gymnasium, or a `VecEnv` of stable-baselines3. The
            statistics of a `VecNormalize` around it are written to FILE-vecnormalize.npz.
        algo: Class of stable-baselines3 that reads the model, such as "ppo".
        vec_normalize: Name of an existing file of `VecNormalize.save` in the folder of the card.

    Raises:
        ValueError: If the observations, actions or rate of the environment cannot be those of an agent.
    """
    path = check_path("file", file)
    normalizer = _normalizer(env)
    if normalizer is not None and vec_normalize is None:
        vec_normalize = f"{path.stem}{NORMALIZER}"
        save_normalizer(normalizer, path.with_name(vec_normalize))
    card = PolicyCard(algo=algo, vec_normalize=vec_normalize, **_values(env))
    _write(path, card)
    return card


def _write(path: Path, card: PolicyCard) -> None:
    with complete_file(card_file(path)) as part:
        part.write_text(json.dumps(card.to_dict(), indent=1) + "\n", "utf-8")


def _normalizer(env: Any) -> Any:
    """Return the `VecNormalize` around an environment, or None."""
    try:
        from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecNormalize
        from stable_baselines3.common.vec_env import unwrap_vec_wrapper as unwrap
    except ImportError:
        raise missing_extra("a card", "train") from None
    if not isinstance(env, VecEnv):
        return None
    if unwrap(env, VecFrameStack) is not None:
        raise ValueError("a card cannot describe VecFrameStack; use PolicyWrapper(env, history=N) instead")
    return unwrap(env, VecNormalize)


def _values(env: Any) -> dict[str, Any]:
    """Return the fields of the card that follow from the specification of an environment."""
    from lgmd_gym.camera.spec import plain_values

    spec: Any = env.get_attr("spec")[0] if hasattr(env, "get_attr") else getattr(env, "spec", None)
    if spec is None:
        raise ValueError(f"the environment {shown(env)} has no spec; make it with gym.make")
    wrappers = {item.name: item.kwargs or {} for item in spec.additional_wrappers}
    sensors = wrappers.get("LGMDObservation", spec.kwargs)
    config = check_mapping("config", spec.kwargs.get("config"))
    demands = _demands(env, config)
    _check_rates(env, spec.kwargs, config)
    features = wrappers.get("PolicyWrapper")
    return {
        "camera": plain_values(sensors.get("camera", "fovea")),
        "neuron": plain_values(sensors.get("params")),
        "features": None if features is None else FeatureConfig.from_dict(features),
        "demands": demands,
    }


def _check_rates(env: Any, arguments: dict[str, Any], config: dict[str, Any]) -> None:
    """Raise ValueError if the decisions or the frames of an environment have another rate than for agents."""
    rate = config.get("policy_frequency", _attribute(env, "config", {}).get("policy_frequency", FPS))
    if rate != FPS:
        raise ValueError(
            f"policy_frequency {rate:g} Hz is not that of agents, {FPS:g} Hz; set {FPS:g} and train with "
            f"PolicyWrapper(env, repeat={max(round(FPS / rate), 1)}) instead"
        )
    fps = arguments.get("fps") or _attribute(env, "fps", FPS)
    if fps != FPS:
        raise ValueError(f"fps {fps:g} Hz is not that of agents, {FPS:g} Hz; train without fps")


def _attribute(env: Any, name: str, default: Any) -> Any:
    """Return an attribute of an environment, or of the first one of a `VecEnv`; the default without it."""
    try:
        return env.get_attr(name)[0] if hasattr(env, "get_attr") else env.get_wrapper_attr(name)
    except AttributeError:
        return default


def _demands(env: Any, config: dict[str, Any]) -> tuple[float, ...] | None:
    from lgmd_gym.envs.spaces import DiscreteDemand

    action = check_mapping("action", config.get("action"))
    space = env.action_space
    if not hasattr(space, "n"):
        if space.shape != (1,) or space.low[0] != -1.0 or space.high[0] != 1.0:
            raise ValueError(f"the action must be one demand in [-1, 1], got {space}")
        return None
    default = inspect.signature(DiscreteDemand).parameters["demands"].default
    demands = tuple(action.get("demands", default))
    if action.get("type") != "DiscreteDemand" or len(demands) != space.n:
        raise ValueError(f"the actions of {space} are not demands; use the action type DiscreteDemand")
    return demands
