"""Hyperparameters in rl-zoo's format: one YAML file per algorithm, one entry per environment."""

from importlib.resources import files
from pathlib import Path
from typing import cast

from lgmd_gym.aliases import Arguments, Values
from lgmd_gym.errors import (
    check_finite,
    check_known,
    check_path,
    check_text,
    check_type,
    check_whole,
    shown,
    unknown_name,
)
from lgmd_gym.processes.inputs import read_text

TIME_TO_BRAKE = "time-to-brake"  # the algorithm of `lgmd_gym.training.offline.time_to_brake`
ALGORITHMS = ("ppo", "sac", "dqn", TIME_TO_BRAKE)
WRAPPER = "lgmd_gym.training.PolicyWrapper"
OPTIONS = (
    *("policy", "env_kwargs", "eval_episodes"),
    *("traffic_episodes", "extra_levels", "error_levels", "extra_traffic"),
)
"""Further options of `TrainConfig` that a file may contain."""


def read_hyperparams(algo: str, env_id: str, file: Path | None = None) -> Values:
    """Return the attributes of `TrainConfig` in a hyperparameter file; `features` is a dict.

    Args:
        algo: One of `ALGORITHMS`.
        env_id: Environment id; the entry `default` is used for an id without an entry.
        file: YAML file in rl-zoo's format; None for the file of this package.

    Raises:
        ValueError: For an unknown algorithm, a file that cannot be read, or one without a matching entry.
    """
    check_known("algorithm", algo, ALGORITHMS)
    check_text("env_id", env_id)
    own = Path(str(files("lgmd_gym.training") / f"{algo}.yml"))
    path = own if file is None else check_path("file", file)
    entries = _read_yaml(path)
    entry = entries.get(env_id, entries.get("default"))
    if not isinstance(entry, dict):
        raise unknown_name("entry of the hyperparameters for", env_id, entries)
    algo_kwargs = dict(cast(Arguments, entry))
    if algo_kwargs.pop("normalize", False):
        raise ValueError("normalize is not supported: PolicyWrapper scales observations by constants")
    values: Values = {"features": _features(algo_kwargs.pop("env_wrapper", None))}
    values |= {name: algo_kwargs.pop(name) for name in OPTIONS if name in algo_kwargs}
    if "env_kwargs" in values:
        check_type("env_kwargs", values["env_kwargs"], dict)
    for name in ("n_timesteps", "n_envs"):
        if name in algo_kwargs:
            values[name] = check_whole(name, check_finite(name, algo_kwargs.pop(name)), 1)  # also 1e5
    for name, value in algo_kwargs.items():
        if isinstance(value, int):
            check_finite(name, int(value))  # YAML has integers that are no float
        if isinstance(value, str) and _is_number(value):
            raise ValueError(
                f"{name} is the text {value!r} in YAML, where an exponent requires a point and a "
                "sign; write for example 3.0e-4"
            )
    return values | {"algo_kwargs": algo_kwargs}


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _read_yaml(path: Path) -> Values:
    import yaml

    try:
        entries: object = yaml.safe_load(read_text(path))
    except OSError as error:
        raise ValueError(f"hyperparameters {str(path)!r} cannot be read: {error.strerror}") from None
    except yaml.YAMLError as error:
        first = str(error).splitlines()[0]
        raise ValueError(f"hyperparameters {str(path)!r} are not valid YAML: {first}") from None
    if not isinstance(entries, dict):
        raise ValueError(f"hyperparameters {str(path)!r} must have one entry per environment id")
    return cast(Values, entries)


def _features(wrappers: object) -> Values:
    """Return the arguments of `PolicyWrapper` in rl-zoo's `env_wrapper`."""
    if wrappers is None:
        return {}
    items = cast(list[object], wrappers) if isinstance(wrappers, list) else [wrappers]
    if len(items) != 1:
        raise ValueError(f"env_wrapper must contain {WRAPPER} only, got {len(items)} wrappers")
    item: object = {items[0]: None} if isinstance(items[0], str) else items[0]
    if not isinstance(item, dict) or list(cast(Values, item)) != [WRAPPER]:
        raise ValueError(f"env_wrapper must be {WRAPPER} alone, got {shown(items[0])}")
    return dict(check_type("arguments of PolicyWrapper", cast(Values, item)[WRAPPER] or {}, dict))
