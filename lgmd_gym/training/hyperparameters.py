"""Hyperparameters in the format of rl-zoo: one YAML file per algorithm, one entry per environment."""

from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

from lgmd_gym.agents.policies.policy import ALGORITHMS
from lgmd_gym.errors import unknown_name

RECORDED = "recorded"  # an algorithm of our own, see `lgmd_gym.training.offline.learner`
WRAPPER = "lgmd_gym.training.PolicyView"


class Settings(NamedTuple):
    """What a training needs to know.

    Attributes:
        n_envs: Environments side by side.
        n_timesteps: Decisions of the policy, over all environments.
        features: Keyword arguments of `PolicyView`.
        policy: stable-baselines3's name of the network.
        model: Everything else; keyword arguments of the algorithm, see `arguments_of`.
    """

    n_envs: int
    n_timesteps: int
    features: dict[str, Any]
    policy: str
    model: dict[str, Any]


def read_settings(algo: str, env_id: str, file: Path | None = None) -> Settings:
    """Return the hyperparameters of an algorithm for an environment.

    Args:
        algo: "ppo", "sac", "dqn" or "recorded".
        env_id: The environment's id; an entry `default` serves all that have none.
        file: A YAML file in rl-zoo's format; None for the one that comes with this package.

    Raises:
        ValueError: For an unknown algorithm, an unreadable file, or one without such an entry.
    """
    known = (*ALGORITHMS, RECORDED)
    if algo not in known:
        raise unknown_name("algorithm", algo, known)
    entries = _read(file or Path(str(files("lgmd_gym.training") / f"{algo}.yml")))
    entry = entries.get(env_id, entries.get("default"))
    if not isinstance(entry, dict):
        raise unknown_name("entry of the hyperparameters for", env_id, entries)
    entry = dict(entry)
    features = _features(entry.pop("env_wrapper", None))
    timesteps = entry.pop("n_timesteps", 100_000)
    try:
        n_timesteps = int(float(timesteps))
    except (TypeError, ValueError):
        raise ValueError(f"n_timesteps must be a number, got {timesteps!r}") from None
    n_envs = int(entry.pop("n_envs", 1))
    policy = str(entry.pop("policy", "MultiInputPolicy"))
    if entry.pop("normalize", False):
        raise ValueError("normalize is not taken: PolicyView scales observations by fixed numbers")
    return Settings(n_envs, n_timesteps, features, policy, entry)


def _read(path: Path) -> dict[str, Any]:
    import yaml

    try:
        read = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"hyperparameters {str(path)!r} cannot be read: {error.strerror}") from None
    except yaml.YAMLError as error:
        first = str(error).splitlines()[0]
        raise ValueError(f"hyperparameters {str(path)!r} are no YAML: {first}") from None
    if not isinstance(read, dict):
        raise ValueError(f"hyperparameters {str(path)!r} need entries by environment id")
    return read


def _features(wrappers: Any) -> dict[str, Any]:
    """Return the arguments of `PolicyView` among rl-zoo's `env_wrapper`."""
    if wrappers is None:
        return {}
    wanted = wrappers if isinstance(wrappers, list) else [wrappers]
    if len(wanted) != 1:
        raise ValueError(f"env_wrapper must be {WRAPPER} alone, got {len(wanted)} wrappers")
    item = wanted[0]
    name, arguments = (item, {}) if isinstance(item, str) else next(iter(item.items()))
    if name != WRAPPER:
        raise ValueError(f"env_wrapper must be {WRAPPER}, got {name!r}")
    return dict(arguments or {})


def arguments_of(model: dict[str, Any]) -> dict[str, Any]:
    """Return an algorithm's keyword arguments from plain values: "lin_x" is a linear decay from x to 0."""
    from stable_baselines3.common.utils import LinearSchedule

    return {
        key: LinearSchedule(float(item[4:]), 0.0, 1.0)
        if isinstance(item, str) and item.startswith("lin_")
        else item
        for key, item in model.items()
    }
