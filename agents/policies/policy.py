"""A learned policy as an agent: a stable-baselines3 model and what it needs to see."""

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.agents.base import Agent
from lgmd_gym.agents.policies.features import FRAME, FeatureConfig, FeatureHistory
from lgmd_gym.errors import unknown_name

CARD = "lgmd_gym.json"  # beside the model, in the same zip
SHIPPED = Path(__file__).parent  # those that come with this package
ALGORITHMS = ("ppo", "sac", "dqn")


class Policy(Agent):
    """Acts as a stable-baselines3 model does, without its exploration.

    The file is a model as `lgmd-gym train` writes it, with a card of what it sees. Loading one runs what its
    author pickled into it, as stable-baselines3's files do: load only files you trust.

    Args:
        path: The zip file, or the name of a policy that comes with this package (`shipped`).

    Raises:
        ValueError: If it cannot be read or is no policy of this package, or stable-baselines3 is missing.
    """

    name = "policy"

    def __init__(self, path: str) -> None:
        super().__init__()
        self.name = f"policy:{path}"
        file = find_policy(path)
        self.card = read_card(file)
        self._memory = FeatureHistory(FeatureConfig.from_dict(self.card["features"]))
        self._levels = self.card["demands"]
        self._model = _load(file, self.card["algo"])
        self.reset()

    @property
    def camera(self) -> Any:
        """What it was trained to look through."""
        return self.card["camera"]

    @property
    def include_frame(self) -> bool:  # type: ignore[override]
        """Whether it was trained on frames."""
        return FRAME in self._memory.features.inputs

    @property
    def alert(self) -> bool:
        """Whether it brakes: that some neuron of many is excited is no warning of the policy's."""
        return self._demand < 0.0

    def reset(self, seed: int | None = None) -> None:
        """Forget the last episode."""
        super().reset(seed)
        self._memory.reset()
        self._decision = 0
        self._demand = 0.0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Decide anew at every `repeat`-th call, else hold; once latched, hold to the end."""
        features = self._memory.features
        if features.latches(self._demand):
            return self._demand
        self._memory.update(observation)
        if self._decision % features.repeat == 0:
            action, _ = self._model.predict(self._memory.stack(), deterministic=True)
            self._demand = self._levels[int(action)] if self._levels else float(np.reshape(action, -1)[0])
        self._decision += 1
        return self._demand


def shipped() -> list[str]:
    """Return the names of the policies that come with this package."""
    return sorted(path.stem for path in SHIPPED.glob("*.zip"))


def find_policy(text: str) -> Path:
    """Return the file of a policy: of a shipped one by its name, else the path that is given.

    Raises:
        ValueError: For a training's folder, or a bare name that is neither shipped nor a file.
    """
    if text in shipped():
        return SHIPPED / f"{text}.zip"
    path = Path(text)
    if (path / "policy.zip").is_file():
        raise ValueError(f"policy {text!r} is a folder; did you mean 'policy:{path / 'policy.zip'}'?")
    if not path.suffix and not path.is_file():
        raise unknown_name("policy (neither a file nor shipped)", text, shipped())
    return path


def read_card(path: Path) -> dict[str, Any]:
    """Return the card of a policy file.

    Raises:
        ValueError: If there is no such file, or it holds no card.
    """
    try:
        with zipfile.ZipFile(path) as file:
            return json.loads(file.read(CARD))
    except OSError as error:
        raise ValueError(f"policy {str(path)!r} cannot be read: {error.strerror or error}") from None
    except (zipfile.BadZipFile, KeyError, ValueError):
        raise ValueError(f"{str(path)!r} is no policy of lgmd-gym train (no {CARD} in it)") from None


def write_card(path: Path, card: dict[str, Any]) -> None:
    """Add a card to a stable-baselines3 model's zip file."""
    with zipfile.ZipFile(path, "a") as file:
        file.writestr(CARD, json.dumps(card, indent=1))


def _load(path: Path, algo: str) -> Any:
    try:
        import stable_baselines3
        import torch
    except ImportError:
        raise ValueError('a policy needs stable-baselines3: pip install "lgmd-gym[train]"') from None
    torch.set_num_threads(1)  # the network is small, and episodes run side by side
    return getattr(stable_baselines3, algo.upper()).load(path, device="cpu")
