"""`TrainConfig`: the options of a training run, from the command line, a YAML file or Python."""

import re
from collections.abc import Callable, Sequence
from dataclasses import MISSING, asdict, dataclass, fields, replace
from numbers import Real
from pathlib import Path
from typing import Any

import gymnasium as gym

from lgmd_gym.agents import AGENTS, make_agent
from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.policies.features import FRAME, FeatureConfig
from lgmd_gym.agents.sides import all_round_cameras
from lgmd_gym.aliases import Arguments, Config, Values
from lgmd_gym.envs.attention import INATTENTIVE
from lgmd_gym.envs.families.distribution import EXTRA_FAMILIES, check_families
from lgmd_gym.envs.registration import TRAFFIC_KINDS, traffic_id
from lgmd_gym.errors import (
    check_items,
    check_keys,
    check_known,
    check_type,
    check_whole,
    check_within,
    shown,
)
from lgmd_gym.fields import Record, optional, record, text, value, whole
from lgmd_gym.sensing.channel import ChannelSpec, make_channels, plain_values
from lgmd_gym.training.hyperparams import ALGORITHMS, TIME_TO_BRAKE, read_hyperparams
from lgmd_gym.training.policy_env import PolicyWrapper

RANDOM_ID = "LGMD/RandomBraking-v0"
ALL_ROUND = "all-round"  # value of `sensors_of` for the cameras of `all_round_cameras`
CAMERAS = ("fovea", "tele", "wide")
SEED_STRIDE = 1_000_000  # distance between the environment seeds of neighbouring training seeds
# distance between the first seeds of neighbouring sets of traffic, or of error levels; most seeds of a set
SET_STRIDE = 100_000
MAX_SEED = 2**32 - 1  # of NumPy's global generator, which stable-baselines3 seeds
VALIDATION_SEED = 10_000  # first environment seed of an evaluation
DEMANDS = {"ppo": (0.0, -1.0), "dqn": (0.0, -1.0), "sac": (), TIME_TO_BRAKE: ()}
LEVELS_EXAMPLE = f"400:{','.join(EXTRA_FAMILIES[:2])}"
TRAFFIC_EXAMPLE = "400:intersection,roundabout"
# options of "time-to-brake" only
_OF_RECORDINGS = ("recordings", "start", "traffic_episodes", "extra_levels", "error_levels", "extra_traffic")


def _check_env_kwargs(name: str, env_kwargs: object) -> Arguments:
    given: Arguments = {} if env_kwargs is None else check_type(name, env_kwargs, dict)
    if "camera" in given:
        raise ValueError(f"{name} contains the camera {shown(given['camera'])}; use the option camera")
    if "neuron" in given:
        raise ValueError(
            f"{name} contains the neuron {shown(given['neuron'])}; use the option --neuron, or in Python "
            "with_neuron"
        )
    config: Config = given.get("config") or {}
    rates = {"fps": given.get("fps"), "policy_frequency": config.get("policy_frequency")}
    for key, rate in rates.items():
        if rate not in (None, FPS):
            raise ValueError(
                f"{key} in {name} must be {FPS:g} Hz, the rate of agents, got {shown(rate)}; "
                "use PolicyWrapper's repeat for fewer decisions"
            )
    return given


def _check_algo_kwargs(name: str, algo_kwargs: object) -> Arguments:
    given: Arguments = {} if algo_kwargs is None else check_type(name, algo_kwargs, dict)
    check_type("policy_kwargs", given.get("policy_kwargs"), dict, type(None))
    return given


def _check_camera(name: str, camera: ChannelSpec) -> Any:
    make_channels(camera)
    return plain_values(camera)


def _check_features(name: str, features: object) -> FeatureConfig:
    return FeatureConfig() if features is None else check_type(name, features, FeatureConfig)


def _check_demands(name: str, demands: object) -> tuple[float, ...]:
    given = check_items(name, demands, Real, "numbers")
    for demand in given:
        check_within(name, demand, -1.0, 1.0)
    if given and (min(given) >= 0.0 or len({*given}) < len(given)):
        raise ValueError(
            f"{name} must be distinct, with one below 0 that brakes, got {list(given)}; "
            "use for example --demands 0 -1"
        )
    return given


def _texts(example: str) -> Callable[[str, object], tuple[str, ...]]:
    """Return a check of texts that name extra episodes."""
    return lambda name, given: check_items(name, given, str, f"texts such as {example!r}")


@record
class TrainConfig(Record):
    """Options of a training run, as plain values apart from `features`.

    `from_hyperparams` fills in the hyperparameters of an algorithm; the constructor reads no file.

    Raises:
        ValueError: If a value is invalid or does not fit the algorithm.
    """

    algo: str = value(
        MISSING,
        lambda _, algo: check_known("algorithm", algo, ALGORITHMS),
        "Algorithm",
        ", ".join(ALGORITHMS),
    )
    env_id: str = text(
        RANDOM_ID,
        "Environment id; an id that is registered with the argument `split`, as those of random levels and "
        'traffic, is trained on the split "train" and evaluated on the split "validation"',
    )
    env_kwargs: Arguments = value(None, _check_env_kwargs, "Further arguments of `gym.make`")
    camera: ChannelSpec = value(CAMERAS, _check_camera, "Camera or cameras, see `LGMDObservation`")
    demands: tuple[float, ...] = value(
        (),
        _check_demands,
        "Demands that the policy chooses from, in [-1, 1]; empty for a continuous demand",
    )
    features: FeatureConfig = value(None, _check_features, "Inputs and timing of the policy")
    n_envs: int = whole(
        1, "[1, inf)", "", 'Number of environments stepped in parallel; not for "time-to-brake"'
    )
    n_timesteps: int = whole(
        100_000,
        "[1, inf)",
        "",
        'Number of policy decisions over all environments; of recorded episodes for "time-to-brake"',
    )
    policy: str = text("MultiInputPolicy", "stable-baselines3's name of the network")
    algo_kwargs: Arguments = value(
        None, _check_algo_kwargs, "Further arguments of the algorithm, as in the YAML file"
    )
    seed: int = whole(0, f"[0, {MAX_SEED}]", "", "Seed of the network and the environments")
    eval_freq: int = whole(
        16_000,
        "[1, inf)",
        "",
        'Number of decisions between two evaluations; "time-to-brake" evaluates after every epoch',
    )
    eval_episodes: int = whole(96, "[1, inf)", "", "Number of episodes per evaluation")
    recordings: str | None = optional(
        text(
            None,
            "Folder of a training run on recorded episodes, to reuse them; None to record anew",
        )
    )
    start: str | None = optional(
        text(
            None,
            'Policy with the same inputs and cameras, or fewer fields ahead, whose network "time-to-brake" '
            "starts from: a file, or a name in this package; None for random weights",
        )
    )
    traffic_episodes: int = whole(
        0,
        "[0, inf)",
        "",
        'Number of traffic episodes that "time-to-brake" trains on in addition; a quarter as many are added '
        "to its evaluations",
    )
    extra_levels: tuple[str, ...] = value(
        (),
        _texts(LEVELS_EXAMPLE),
        'Levels that "time-to-brake" trains on in addition, a number and scenario families each, for '
        f'example "{LEVELS_EXAMPLE}"; a twentieth as many are added to its evaluations',
    )
    error_levels: tuple[str, ...] = value(
        (),
        _texts(LEVELS_EXAMPLE),
        "As `extra_levels`, but every level has errors of the sensor that no calibration finds",
    )
    extra_traffic: tuple[str, ...] = value(
        (),
        _texts(TRAFFIC_EXAMPLE),
        'Traffic episodes of some kinds that "time-to-brake" trains on in addition, a number and the kinds '
        f'each, for example "{TRAFFIC_EXAMPLE}" or "400:inattentive-highway" with drivers who err; a quarter '
        "as many are added to its evaluations",
    )

    def check(self) -> None:
        """Raise ValueError for values that do not fit the algorithm."""
        if self.algo == "dqn" and not self.demands:
            raise ValueError("dqn requires discrete demands; use for example --demands 0 -1")
        if self.algo == "sac" and self.demands:
            raise ValueError(f"sac requires a continuous demand, got demands {list(self.demands)}; omit them")
        _check_extra_episodes(self)
        if self.algo == TIME_TO_BRAKE:
            _check_time_to_brake(self)
            return
        for name in _OF_RECORDINGS:
            if getattr(self, name):
                raise ValueError(f"{name} requires algo {TIME_TO_BRAKE!r}, got {self.algo!r}; omit it")

    @classmethod
    def from_hyperparams(
        cls,
        algo: str = "dqn",
        env_id: str = RANDOM_ID,
        file: Path | None = None,
        *,
        inputs: Sequence[str] = (),
        sensors_of: str | None = None,
        **options: Any,
    ) -> "TrainConfig":
        """Return the configuration for an environment from a hyperparameter file.

        Args:
            algo: "ppo", "sac", "dqn" or "time-to-brake".
            env_id: Environment id; the entry `default` is used for an id without an entry.
            file: YAML file in rl-zoo's format; None for the file of this package.
            inputs: Inputs of the policy in place of those in the file.
            sensors_of: Name of an agent whose cameras are used, such as "stopping-zone"; or "all-round" for
                the fields ahead and at the sides of `policy:all-round`. None for the option `camera`, or the
                cameras that the inputs require.
            **options: Attributes of `TrainConfig` that replace those in the file; None keeps the default.

        Raises:
            ValueError: For unknown names, invalid values, or a file that cannot be read.
        """
        check_keys("training option", options, (item.name for item in fields(cls)))
        given = {name: value for name, value in options.items() if value is not None}
        if sensors_of is not None:
            if "camera" in given:
                raise ValueError(
                    f"use either camera or sensors_of, got {given['camera']!r} and {sensors_of!r}"
                )
            given["camera"] = _cameras_of(sensors_of)
        values = read_hyperparams(algo, env_id, file)
        if check_items("inputs", inputs, str, "names"):
            values["features"] |= {"inputs": inputs}
        features = values["features"] = FeatureConfig.make(values["features"])
        defaults: Arguments = {
            "demands": DEMANDS[algo],
            "eval_episodes": 600 if algo == TIME_TO_BRAKE else 96,
        }
        agent = features.cameras_of
        if agent is not None:
            defaults["camera"] = _cameras_of(agent)
        merged: Arguments = {**defaults, **values, "algo": algo, "env_id": env_id, **given}
        return cls(**merged)

    def with_neuron(self, neuron: str) -> "TrainConfig":
        """Return the configuration with a neuron model for the cameras without one of their own.

        Args:
            neuron: Specification of the model, see `lgmd_gym.neuron.check_model`.

        Raises:
            ValueError: For an unknown model or option, or a module that cannot be imported.
        """
        return replace(self, camera=plain_values(make_channels(self.camera, neuron)))

    @classmethod
    def from_dict(cls, values: Values) -> "TrainConfig":
        """Return the configuration that `to_dict` returned; unknown keys raise ValueError."""
        check_keys("training option", values, (item.name for item in fields(cls)))
        features = FeatureConfig.make(values.get("features", {}))
        merged: Arguments = values | {"features": features}
        return cls(**merged)

    def to_dict(self) -> Values:
        """Return the configuration as plain values."""
        return asdict(self) | {"features": self.features.to_dict()}

    def make_env(self, split: str, camera: ChannelSpec | None = None) -> gym.Env:
        """Return an environment with `LGMDObservation`.

        Args:
            split: "train", "validation" or "test"; ignored by environments without splits.
            camera: Cameras in place of the configured ones.
        """
        try:
            arguments = self.env_arguments(split)
            arguments["camera"] = camera or self.camera
            return gym.make(self.env_id, **arguments)
        except gym.error.Error as error:
            raise ValueError(
                f"env {self.env_id!r} cannot be made ({error}); see lgmd-gym list envs"
            ) from None

    def env_arguments(self, split: str) -> Arguments:
        """Return the arguments of `gym.make` and `gym.make_vec` for a split."""
        arguments: Arguments = self.env_kwargs | {"camera": self.camera}
        if "split" in gym.spec(self.env_id).kwargs:
            arguments.setdefault("split", split)
        if self.demands:
            action = {"type": "DiscreteDemand", "demands": list(self.demands)}
            arguments["config"] = {**(arguments.get("config") or {}), "action": action}
        if FRAME in self.features.inputs:
            arguments["include_frame"] = True
        return arguments

    @property
    def first_seed(self) -> int:
        """First seed of the training environments; that of an evaluation is `VALIDATION_SEED`.

        A level is the same for every seed, and its split sets the levels. Other environments, among them
        traffic, follow from the seed; the seeds below `SEED_STRIDE` are those of validation and test.
        """
        has_levels = "split" in gym.spec(self.env_id).kwargs and "split" not in self.env_kwargs
        return SEED_STRIDE * (self.seed + (not has_levels or self.env_id in map(traffic_id, TRAFFIC_KINDS)))

    def features_of(self, split: str) -> FeatureConfig:
        """Return the inputs and timing of the policy; rewards are scaled on "train" only."""
        return self.features if split == "train" else replace(self.features, reward_scale=1.0)

    def make_policy_env(self, split: str) -> PolicyWrapper:
        """Return an environment with the policy's observations."""
        return PolicyWrapper(self.make_env(split), **self.features_of(split).to_dict())


def _cameras_of(agent: str) -> ChannelSpec:
    if agent == ALL_ROUND:
        return all_round_cameras()
    if ":" not in agent:
        check_known("agent", agent, [*AGENTS, ALL_ROUND])
    camera = make_agent(agent).camera
    if camera is None:
        raise ValueError(f"agent {agent!r} has no cameras of its own; use camera, or 'stopping-zone'")
    return camera


@dataclass(frozen=True)
class ExtraEpisodes:
    """A number of episodes, and the families of their levels or the kinds of their traffic."""

    count: int
    names: tuple[str, ...]


def parse_levels(text: str, option: str = "extra_levels") -> ExtraEpisodes:
    """Return the levels of a text such as "400:CCRsCurve,StandingBox".

    Args:
        text: A number and scenario families.
        option: Name of the option, for messages.

    Raises:
        ValueError: If the text has another form, for an unknown family, or for one that is named twice.
    """
    return _parse_extra(option, text, LEVELS_EXAMPLE, "family", check_families)


def parse_traffic(text: str) -> ExtraEpisodes:
    """Return the traffic episodes of a text such as "400:intersection,roundabout".

    Raises:
        ValueError: If the text has another form, for an unknown kind, or for one that is named twice.
    """
    return _parse_extra("extra_traffic", text, TRAFFIC_EXAMPLE, "kind", _check_kinds)


def _check_kinds(names: list[str]) -> tuple[str, ...]:
    known = (*TRAFFIC_KINDS, *(INATTENTIVE + kind for kind in TRAFFIC_KINDS))
    return tuple(check_known("kind of traffic", name, known) for name in names)


def _parse_extra(
    option: str, text: str, example: str, noun: str, check: Callable[[list[str]], tuple[str, ...]]
) -> ExtraEpisodes:
    """Return the number and the checked names of a text "NUMBER:NAME,NAME"."""
    match = re.fullmatch(r"\s*([0-9]{1,9})\s*:(.+)", text)
    if match is None:
        raise ValueError(f"{option} must be like {example!r}, got {shown(text)}")
    count = check_whole(f"number of {option}", int(match[1]), 1, SET_STRIDE)
    names = check([name.strip() for name in match[2].split(",")])
    if len(set(names)) < len(names):
        raise ValueError(f"{option} names a {noun} twice: {shown(text)}; use each name once")
    return ExtraEpisodes(count, names)


def _check_extra_episodes(config: "TrainConfig") -> None:
    """Raise ValueError for texts that name no episodes, or the same levels twice."""
    for kinds in config.extra_traffic:
        parse_traffic(kinds)
    families = [family for item in config.extra_levels for family in parse_levels(item).names]
    repeated = next((family for family in families if families.count(family) > 1), None)
    if repeated is not None:  # the sets start at the same seed
        raise ValueError(
            f"extra_levels names {repeated!r} in two sets, which would contain the same levels; "
            "increase the number of one set"
        )
    for item in config.error_levels:
        parse_levels(item, "error_levels")
    for name in ("extra_levels", "error_levels"):
        if getattr(config, name) and config.env_id != RANDOM_ID:
            raise ValueError(f"{name} requires env {RANDOM_ID!r}, got {config.env_id!r}; omit it")


def _check_time_to_brake(config: "TrainConfig") -> None:
    """Raise ValueError for values that recorded episodes do not support."""
    if config.demands:
        raise ValueError(
            f"algo 'time-to-brake' has a brake with stages, got demands {list(config.demands)}; omit demands"
        )
    if config.features.latch:
        raise ValueError("algo 'time-to-brake' requires latch: false in its hyperparameters")
    if config.features.history != 1 or FRAME in config.features.inputs:
        raise ValueError("algo 'time-to-brake' requires history: 1 and inputs without frame")
    usual = FeatureConfig()
    for name, given, default in (
        ("n_envs", config.n_envs, 1),
        ("reward_scale", config.features.reward_scale, usual.reward_scale),
        ("shrink", config.features.shrink, usual.shrink),
    ):
        if given != default:
            raise ValueError(f"{name} has no effect with algo 'time-to-brake', got {given:g}; omit it")
    changed = set(config.env_kwargs.get("config") or {}) - {"action"}
    if changed and (config.traffic_episodes or config.extra_traffic):
        raise ValueError(
            f"traffic episodes have the default {', '.join(sorted(changed))}, got others in config of "
            "env_kwargs; omit them, or traffic_episodes and extra_traffic"
        )
