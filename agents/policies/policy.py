"""`Policy`: a stable-baselines3 model as an agent, and the card in its file."""

import json
import sys
import zipfile
import zlib
from functools import cache
from multiprocessing import current_process
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.agents.base import Agent
from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.policies.batch import PolicyBatch
from lgmd_gym.agents.policies.features import FRAME, FeatureConfig, FeatureHistory
from lgmd_gym.errors import check_path, check_text, shown, unknown_name
from lgmd_gym.system.extras import missing_extra

if TYPE_CHECKING:
    from lgmd_gym.camera import CameraSpec

CARD = "lgmd_gym.json"  # member of the model's zip file
_ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError)
SHIPPED = Path(__file__).parent  # folder of the policies in this package


class Policy(Agent):
    """Agent that acts with a trained stable-baselines3 model, without exploration.

    The file is a model of `lgmd-gym train` with a card: a JSON member with the cameras, features and demands.
    Loading a policy unpickles its file and can run arbitrary code, as with all stable-baselines3 files.
    Load only files from sources you trust.

    Args:
        path: Zip file, or name of a policy in this package.

    Attributes:
        card: Card of the file.
        features: Inputs of the policy.
        model: The stable-baselines3 model.

    Raises:
        ValueError: If the file cannot be read or has no card, or if stable-baselines3 is not installed.
    """

    name = "policy"

    def __init__(self, path: str) -> None:
        self.name = f"policy:{check_text('path', path)}"
        file = find_policy(path)
        self.card = read_card(file)
        self.features = FeatureConfig.from_dict(self.card["features"])
        self._history = FeatureHistory(self.features)
        if file.parent != SHIPPED:
            _announce(file)
        self.model = _load_model(file, self.card["algo"])
        self._check_model(file)
        self.reset()

    def _check_model(self, file: Path) -> None:
        """Raise ValueError unless the inputs and actions of the model are those of the card."""
        inputs = set(getattr(self.model.observation_space, "spaces", ()))
        actions, demands = getattr(self.model.action_space, "n", None), self.card["demands"]
        if inputs != set(self.features.inputs) or actions != (len(demands) if demands else None):
            raise ValueError(f"policy {str(file)!r}: model and card do not belong together; train it again")

    @property
    def camera(self) -> "CameraSpec":
        """Cameras of the training."""
        return self.card["camera"]

    @property
    def include_frame(self) -> bool:  # type: ignore[override]
        """Whether camera frames are among the inputs."""
        return FRAME in self.features.inputs

    @property
    def alert(self) -> bool:
        """Whether the policy brakes; the alerts of individual neurons are not used."""
        return self._demand < 0.0

    def reset(self, seed: int | None = None) -> None:
        """Clear the history and release the brake."""
        super().reset(seed)
        self._history.reset()
        self._decisions = 0
        self._demand = 0.0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return a new demand at every `repeat`-th call, else the last one; hold a latched demand."""
        if self.features.latches(self._demand):
            return self._demand
        self._history.update(observation)
        if self._decisions % self.features.repeat == 0:
            self._demand = self.decide(self._history.stack())
        self._decisions += 1
        return self._demand

    def decide(self, inputs: dict[str, np.ndarray]) -> float:
        """Return the demand for the inputs of one decision."""
        action, _ = self.model.predict(inputs, deterministic=True)
        demands = self.card["demands"]
        return demands[int(action)] if demands else float(np.reshape(action, -1)[0])

    def batch(self, num_envs: int) -> BatchAgent:
        """Return this policy for `num_envs` environments."""
        return PolicyBatch(self, num_envs)


def shipped_policies() -> list[str]:
    """Return the names of the policies in this package."""
    return sorted(path.stem for path in SHIPPED.glob("*.zip"))


def find_policy(text: str) -> Path:
    """Return the file of a policy: a name in this package, or a path.

    Raises:
        ValueError: For a training folder, or a name without suffix that is not a policy.
    """
    if text in shipped_policies():
        return SHIPPED / f"{text}.zip"
    path = check_path("policy", text)
    if (path / "policy.zip").is_file():
        raise ValueError(f"policy {text!r} is a folder; did you mean 'policy:{path / 'policy.zip'}'?")
    if not path.suffix and not path.is_file():
        raise unknown_name("policy", text, shipped_policies())
    return path


def read_card(path: Path) -> dict[str, Any]:
    """Return the card of a policy file.

    Raises:
        ValueError: If the file does not exist or has no card, or if the card is damaged.
    """
    try:
        with zipfile.ZipFile(path) as file:
            card = json.loads(file.read(CARD))
    except OSError as error:
        raise ValueError(f"policy {shown(str(path))} cannot be read: {error.strerror or error}") from None
    except (KeyError, *_ZIP_ERRORS):
        raise ValueError(f"{shown(str(path))} is not a policy file: it contains no {CARD}") from None
    try:
        _check_card(card)
    except (AttributeError, TypeError, ValueError) as error:
        raise ValueError(
            f"policy {shown(str(path))}: the card is damaged ({error}); train it again"
        ) from None
    return card


def _check_card(card: Any) -> None:
    """Raise AttributeError, TypeError or ValueError unless a card describes a policy."""
    from lgmd_gym.sensing.cameras import make_cameras  # imports numba, which takes half a second

    missing = [key for key in ("algo", "camera", "demands", "features") if key not in card]
    if missing:
        raise ValueError(f"{', '.join(missing)} missing")
    FeatureConfig.from_dict(card["features"])
    make_cameras(card["camera"])
    for demand in card["demands"] or ():
        if isinstance(demand, bool) or not isinstance(demand, int | float) or not -1.0 <= demand <= 1.0:
            raise ValueError(f"demand {demand!r} is not a number in [-1, 1]")


def write_card(path: Path, card: dict[str, Any]) -> None:
    """Add a card to the zip file of a stable-baselines3 model."""
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(CARD, json.dumps(card, indent=1))


@cache
def _announce(path: Path) -> None:
    """Print once that a file is unpickled; worker processes leave it to their parent."""
    if current_process().name == "MainProcess":
        print(f"lgmd-gym: unpickling policy {shown(str(path))}, which can run any code", file=sys.stderr)


def _load_model(path: Path, algo: str) -> Any:
    try:
        import stable_baselines3
        import torch
    except ImportError:
        raise missing_extra("a policy", "train") from None
    torch.set_num_threads(1)  # small network; episodes run in parallel processes
    try:
        return getattr(stable_baselines3, str(algo).upper()).load(path, device="cpu")
    except Exception as error:  # of the archive, pickle, PyTorch or stable-baselines3
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise ValueError(f"policy {shown(str(path))} cannot be loaded ({reason}); train it again") from None
