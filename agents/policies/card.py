"""`PolicyCard`: what a stable-baselines3 file does not contain: cameras, inputs and demands of its policy.

`save_policy` and `save_card` write cards for models that were trained by hand, with rl-zoo or its callbacks.
"""

import inspect
import json
import zipfile
import zlib
from dataclasses import MISSING, replace
from errno import EFBIG
from math import inf
from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

from lgmd_gym.agents.base import FPS
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.features import NORMALIZER_SUFFIX, FeatureConfig, save_normalizer
from lgmd_gym.agents.policies.network import NetworkSpec, describe_network
from lgmd_gym.agents.policies.weights import WEIGHTS
from lgmd_gym.aliases import Arguments, Config, Values
from lgmd_gym.errors import (
    check_items,
    check_mapping,
    check_path,
    check_text,
    check_type,
    check_within,
    shown,
)
from lgmd_gym.fields import Record, optional, record, text, value
from lgmd_gym.processes.extras import missing_extra
from lgmd_gym.processes.files import complete_file
from lgmd_gym.processes.inputs import check_regular, read_json

if TYPE_CHECKING:
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.vec_env import VecNormalize

    from lgmd_gym.neuron import NeuronSpec
    from lgmd_gym.sensing.channel import ChannelSpec

_T = TypeVar("_T")
TrainingEnv: TypeAlias = Any
"""An environment of Gymnasium, or a `VecEnv` of stable-baselines3."""
NORMALIZER = f"-vecnormalize{NORMALIZER_SUFFIX}"  # end of the name of the file with the statistics
MAX_POLICY = 1_000_000_000  # bytes of a policy file and its members
CARD = "lgmd_gym.json"  # member of the zip file of a policy of `lgmd-gym train`
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)


def _check_cameras(name: str, camera: _T) -> _T:
    from lgmd_gym.sensing.channel import make_channels  # imports numba, which takes half a second

    make_channels(cast("ChannelSpec", camera))
    return camera


def _check_neuron(name: str, neuron: _T) -> _T:
    from lgmd_gym.neuron import LGMDParams

    LGMDParams.make(cast("NeuronSpec", neuron))
    return neuron


def _check_demands(name: str, demands: object) -> tuple[float, ...] | None:
    items = check_items(name, demands, object, "numbers")
    for demand in items:
        check_within("demand", demand, -1.0, 1.0)
    return items or None


def _check_features(name: str, features: object) -> FeatureConfig:
    return FeatureConfig.make(cast("FeatureConfig | Values", check_type(name, features, dict, FeatureConfig)))


def _check_network(name: str, network: object) -> NetworkSpec:
    return NetworkSpec.make(cast("NetworkSpec | Values", check_type(name, network, dict, NetworkSpec)))


def _check_brake(name: str, brake: object) -> TimeToBrakeParams:
    values = cast("TimeToBrakeParams | Values", check_type(name, brake, dict, TimeToBrakeParams))
    return TimeToBrakeParams.make(values)


def _check_normalizer(name: str, file: object) -> str:
    text = check_text(name, file)
    if text != PureWindowsPath(text).name or text in ("", ".", ".."):
        raise ValueError(f"{name} must be the name of a file beside the policy, got {shown(text)}")
    return text


@record
class PolicyCard(Record):
    """Description of a policy, as JSON in `FILE.json` beside the model `FILE.zip`."""

    label = "card"

    algo: str = text(MISSING, 'Class of stable-baselines3 that reads the model, such as "ppo"')
    camera: "ChannelSpec" = value(
        MISSING, _check_cameras, "Cameras of the training, as in the argument `camera` of the environments"
    )
    neuron: Values | None = optional(
        value(None, _check_neuron, "Neuron parameters that differ from the defaults; None for the defaults")
    )
    features: FeatureConfig | None = optional(
        value(
            None,
            _check_features,
            "Arguments of `PolicyWrapper` in the training; None without it, for observations as the "
            "environment returns them",
        )
    )
    demands: tuple[float, ...] | None = optional(
        value(
            None,
            _check_demands,
            "Demand of each discrete action, in [-1, 1]; None for a continuous demand",
        )
    )
    brake: TimeToBrakeParams | None = optional(
        value(
            None,
            _check_brake,
            "Brake with stages, for a policy whose discrete actions are intervals of the time to brake; None "
            "for actions that are demands",
        )
    )
    vec_normalize: str | None = optional(
        value(
            None,
            _check_normalizer,
            "Name of the statistics of a `VecNormalize`, beside the card: a file .npz of `save_card`, or, "
            "without `network`, one of `VecNormalize.save`, which is unpickled; None for no statistics",
        )
    )
    network: NetworkSpec | None = optional(
        value(
            None,
            _check_network,
            "Network, with which loading executes no code of the file; None to unpickle the file",
        )
    )

    def check(self) -> None:
        """Raise ValueError for values that do not belong together."""
        if self.brake is not None and (self.demands or (self.features and self.features.latch)):
            raise ValueError("a card with brake must have no demands, and no latch in its features")
        name = self.vec_normalize
        if self.network is not None and name is not None and not name.endswith(NORMALIZER_SUFFIX):
            raise ValueError(
                f"vec_normalize must be a file {NORMALIZER_SUFFIX} of save_card in a card with network, got "
                f"{shown(name)}, which would be unpickled"
            )

    @property
    def num_actions(self) -> int | None:
        """Number of discrete actions; None for a continuous demand."""
        if self.brake is not None:
            return self.brake.num_actions
        return len(self.demands) if self.demands else None


def card_file(path: Path) -> Path:
    """Return the path of the card beside a policy file."""
    return path.with_suffix(".json")


def read_card(path: Path) -> Values:
    """Return the card of a policy file as plain values: the one inside, else the one beside it.

    A card of `lgmd-gym train` also has the configuration of the training.

    Raises:
        ValueError: If the file does not exist, is not a zip file or has no card.
    """
    try:
        check_regular(path, MAX_POLICY)
        with zipfile.ZipFile(path) as file:
            size = sum(item.file_size for item in file.infolist())
            if size > MAX_POLICY:
                raise OSError(EFBIG, f"it unpacks to {size} bytes, more than {MAX_POLICY}")
            if CARD in file.namelist():
                return check_type("card", json.loads(file.read(CARD)), dict)
            if WEIGHTS not in file.namelist():  # a truncated file may look like a zip file
                raise zipfile.BadZipFile
    except OSError as error:
        raise ValueError(f"policy {shown(str(path))} cannot be read: {error.strerror or error}") from None
    except _ZIP_ERRORS:
        raise ValueError(f"{shown(str(path))} is not a policy file of stable-baselines3") from None
    try:
        return check_type("card", read_json(card_file(path)), dict)
    except FileNotFoundError:
        raise ValueError(
            f"policy {shown(str(path))} has no card; write {shown(str(card_file(path)))} with "
            "lgmd_gym.agents.policies.save_card(file, env), or by hand: "
            '{"algo": "ppo", "camera": "fovea"} (see the page "Your model in the loop")'
        ) from None
    except (OSError, ValueError) as error:
        raise ValueError(f"card {shown(str(card_file(path)))} is damaged: {error}") from None


def policy_card(path: Path) -> PolicyCard:
    """Return the checked card of a policy file.

    Raises:
        ValueError: See `read_card`; or if the card is damaged.
    """
    values = read_card(path)
    try:
        if "config" in values:  # of `lgmd-gym train`
            values = {name: item for name, item in values.items() if name in PolicyCard.__dataclass_fields__}
        missing = [name for name in ("algo", "camera") if name not in values]
        if missing:
            raise ValueError(f"{', '.join(missing)} missing")
        return PolicyCard.make(values)
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"policy {shown(str(path))}: the card is damaged ({error})") from None


def write_card(path: Path, card: Values) -> None:
    """Add a card to the zip file of a stable-baselines3 model."""
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(CARD, _as_json(card))


def save_policy(model: "BaseAlgorithm", file: str | Path, env: TrainingEnv | None = None) -> Path:
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


def save_card(file: str | Path, env: TrainingEnv, algo: str, vec_normalize: str | None = None) -> PolicyCard:
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
        part.write_text(_as_json(card.to_dict()) + "\n", "utf-8")


def _as_json(card: Values) -> str:
    """Return a card as JSON, which has no infinity: infinite numbers are defaults (`release_s`), left out."""
    return json.dumps(_finite(card), indent=1, allow_nan=False)


def _finite(value: object) -> object:
    if not isinstance(value, dict):
        return value
    items = cast("Values", value).items()
    return {name: _finite(item) for name, item in items if item != inf}


def _normalizer(env: TrainingEnv) -> "VecNormalize | None":
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


def _values(env: TrainingEnv) -> Values:
    """Return the fields of the card that follow from the specification of an environment."""
    from lgmd_gym.sensing.channel import LGMD, make_channels, plain_values

    spec: Any = env.get_attr("spec")[0] if hasattr(env, "get_attr") else getattr(env, "spec", None)
    if spec is None:
        raise ValueError(f"the environment {shown(env)} has no spec; make it with gym.make")
    wrappers: dict[str, Arguments] = {item.name: item.kwargs or {} for item in spec.additional_wrappers}
    kwargs: Arguments = spec.kwargs
    sensors = wrappers.get("LGMDObservation", kwargs)
    config = check_mapping("config", spec.kwargs.get("config"))
    demands = _demands(env, config)
    _check_rates(env, spec.kwargs, config)
    features = wrappers.get("PolicyWrapper")
    camera, neuron = sensors.get("camera", "fovea"), sensors.get("neuron", LGMD)
    return {
        "camera": plain_values(camera if neuron == LGMD else make_channels(camera, neuron)),
        "neuron": plain_values(sensors.get("params")),
        "features": None if features is None else FeatureConfig.make(features),
        "demands": demands,
    }


def _check_rates(env: TrainingEnv, arguments: Arguments, config: Config) -> None:
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


def _attribute(env: TrainingEnv, name: str, default: object) -> Any:
    """Return an attribute of an environment, or of the first one of a `VecEnv`; the default without it."""
    try:
        return env.get_attr(name)[0] if hasattr(env, "get_attr") else env.get_wrapper_attr(name)
    except AttributeError:
        return default


def _demands(env: TrainingEnv, config: Config) -> tuple[float, ...] | None:
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
