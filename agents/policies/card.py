"""`PolicyCard`: what a stable-baselines3 file does not contain: cameras, inputs and demands of its policy."""

import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lgmd_gym.agents.policies.features import FeatureConfig
from lgmd_gym.agents.policies.network import WEIGHTS, NetworkSpec
from lgmd_gym.errors import check_items, check_keys, check_text, check_type, check_within, shown

if TYPE_CHECKING:
    from lgmd_gym.camera import CameraSpec

CARD = "lgmd_gym.json"  # member of the zip file of a policy of `lgmd-gym train`
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyCard:
    """Description of a policy, as JSON in `FILE.json` beside the model `FILE.zip`.

    Attributes:
        algo: Class of stable-baselines3 that reads the model, such as "ppo".
        camera: Cameras of the training, as in the argument `camera` of the environments.
        neuron: Neuron parameters that differ from the defaults; None for the defaults.
        features: Arguments of `PolicyWrapper` in the training; None without it, for observations as the
            environment returns them.
        demands: Demand of each discrete action, in [-1, 1]; None for a continuous demand.
        vec_normalize: Statistics of a `VecNormalize`, beside the card: a file .npz of `save_card`, or one of
            `VecNormalize.save`, which is unpickled; None for a training without it.
        network: Network, with which loading executes no code of the file; None to unpickle the file.

    Raises:
        ValueError: For a value of another type or out of range.
    """

    algo: str
    camera: "CameraSpec"
    neuron: dict[str, Any] | None = None
    features: FeatureConfig | None = None
    demands: tuple[float, ...] | None = None
    vec_normalize: str | None = None
    network: NetworkSpec | None = None

    def __post_init__(self) -> None:
        from lgmd_gym.neuron import LGMDParams
        from lgmd_gym.sensing.cameras import make_cameras  # imports numba, which takes half a second

        check_text("algo", self.algo)
        make_cameras(self.camera)
        LGMDParams.make(self.neuron)
        if self.demands is not None:
            demands = check_items("demands", self.demands, object, "numbers") or None
            for demand in demands or ():
                check_within("demand", demand, -1.0, 1.0)
            object.__setattr__(self, "demands", demands)
        if self.vec_normalize is not None:
            check_text("vec_normalize", self.vec_normalize)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "PolicyCard":
        """Return the card for plain values.

        Raises:
            ValueError: If `algo` or `camera` is missing, a key is unknown, or a value is invalid.
        """
        missing = [key for key in ("algo", "camera") if key not in values]
        if missing:
            raise ValueError(f"{', '.join(missing)} missing")
        check_keys("key of the card", values, cls.__dataclass_fields__)
        features = values.get("features")
        if features is not None:
            features = FeatureConfig.from_dict(check_type("features", features, dict))
        network = values.get("network")
        if network is not None:
            network = NetworkSpec.from_dict(check_type("network", network, dict))
        return cls(**{**values, "features": features, "network": network})

    def to_dict(self) -> dict[str, Any]:
        """Return the card as plain values."""
        features = None if self.features is None else self.features.to_dict()
        return asdict(self) | {"features": features}


def card_file(path: Path) -> Path:
    """Return the path of the card beside a policy file."""
    return path.with_suffix(".json")


def read_card(path: Path) -> dict[str, Any]:
    """Return the card of a policy file as plain values: the one inside, else the one beside it.

    A card of `lgmd-gym train` also has the configuration of the training.

    Raises:
        ValueError: If the file does not exist, is not a zip file or has no card.
    """
    try:
        with zipfile.ZipFile(path) as file:
            if CARD in file.namelist():
                return check_type("card", json.loads(file.read(CARD)), dict)
            if WEIGHTS not in file.namelist():  # a truncated file may look like a zip file
                raise zipfile.BadZipFile
    except OSError as error:
        raise ValueError(f"policy {shown(str(path))} cannot be read: {error.strerror or error}") from None
    except _ZIP_ERRORS:
        raise ValueError(f"{shown(str(path))} is not a policy file of stable-baselines3") from None
    try:
        return check_type("card", json.loads(card_file(path).read_text("utf-8")), dict)
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
            values = {key: value for key, value in values.items() if key in PolicyCard.__dataclass_fields__}
        return PolicyCard.from_dict(values)
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(f"policy {shown(str(path))}: the card is damaged ({error})") from None


def write_card(path: Path, card: dict[str, Any]) -> None:
    """Add a card to the zip file of a stable-baselines3 model."""
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(CARD, json.dumps(card, indent=1))
