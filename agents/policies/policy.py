"""`Policy`: a stable-baselines3 model as an agent."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from lgmd_gym.agents.base import Agent
from lgmd_gym.agents.batch import BatchAgent
from lgmd_gym.agents.policies.batch import PolicyBatch
from lgmd_gym.agents.policies.card import PolicyCard, policy_card
from lgmd_gym.agents.policies.features import FRAME, SCALES, FeatureConfig
from lgmd_gym.agents.policies.inputs import PolicyInputs, announce_pickle, load_normalizer, make_inputs
from lgmd_gym.errors import check_path, check_text, check_within, shown, unknown_name
from lgmd_gym.processes.extras import missing_extra

if TYPE_CHECKING:
    from lgmd_gym.camera import CameraSpec
    from lgmd_gym.neuron import NeuronSpec

NOT_NEURONS = (FRAME, "ego_speed", "speed_change", "ego_yaw_rate", "known_deceleration")
RAW_INPUTS = (*SCALES, FRAME)  # observations of `LGMDObservation`
SHIPPED = Path(__file__).parent  # folder of the policies in this package
MAX_MARGIN = 20.0  # of log odds; the sensible range is about -4 to 4


class Policy(Agent):
    """Agent that acts with a trained stable-baselines3 model, without exploration.

    The file is a model of stable-baselines3 with a card (`PolicyCard`), inside it or beside it: the cameras,
    features and demands. With a card that describes the network, as of `lgmd-gym train`, loading reads the
    weights only. Other files are unpickled, which can execute any code: load only those that you trust.
    Loading sets the number of PyTorch's threads in the process to 1, see `torch.set_num_threads`.

    Args:
        path: Zip file, or name of a policy in this package.
        margin: Log odds of braking above which the policy brakes, in [-20, 20]; not 0 only for a policy that
            chooses one of two demands by their probabilities, such as those of `--algo offline`. Above 0, the
            policy brakes later and less often: it has fewer false activations and avoids fewer contacts.

    Attributes:
        card: The card.
        features: Inputs of the policy and its decision rate.
        network: The policy of stable-baselines3, a `BasePolicy`, whose bias includes the margin.

    Raises:
        ValueError: If the file cannot be read or has no card, if stable-baselines3 is not installed, or for a
            margin that is out of range or not supported.
    """

    name = "policy"

    def __init__(self, path: str, margin: float = 0.0) -> None:
        self.name = f"policy:{check_text('path', path)}"
        check_within("margin", margin, -MAX_MARGIN, MAX_MARGIN)
        file = find_policy(path)
        self.card = policy_card(file)
        self.network = _load_network(file, self.card)
        names = tuple(getattr(self.network.observation_space, "spaces", ()))
        self._check_network(file, names)
        if margin != 0.0:
            self._subtract(margin)
            self.name += f":margin={margin:.12g}"
        raw = FeatureConfig(inputs=names, history=1, repeat=1, shrink=1)
        self.features = raw if self.card.features is None else self.card.features
        name = self.card.vec_normalize
        self._normalizer = None if name is None else load_normalizer(file.parent / name)
        self._inputs = self.make_inputs()
        self.reset()

    def _check_network(self, file: Path, names: tuple[str, ...]) -> None:
        """Raise ValueError unless the inputs, cameras and actions of the network are those of the card."""
        card, space = self.card, self.network.observation_space
        expected = set(names) & set(RAW_INPUTS) if card.features is None else set(card.features.inputs)
        actions, demands = getattr(self.network.action_space, "n", None), card.demands
        faults: list[str] = []
        if set(names) != expected or not names:
            faults.append(f"inputs {', '.join(names) or space} instead of {', '.join(sorted(expected))}")
        if actions != (len(demands) if demands else None):
            faults.append(
                f"{actions or 'continuous'} actions instead of {len(demands or ()) or 'continuous'}"
            )
        if not faults and card.features is None and "spike_frequency" in names:
            cameras = space["spike_frequency"].shape[0], _count(card.camera)
            faults += [f"{cameras[0]} cameras instead of {cameras[1]}"] if cameras[0] != cameras[1] else []
        if faults:
            raise ValueError(
                f"policy {str(file)!r}: model and card do not belong together: the model has "
                f"{'; '.join(faults)}; correct the card, or train it again"
            )

    def _subtract(self, margin: float) -> None:
        """Reduce the log odds of braking by a margin."""
        demands, layer = self.card.demands, getattr(self.network, "action_net", None)
        if demands is None or len(demands) != 2 or layer is None:
            raise ValueError(
                f"{self.name} must have two demands and action probabilities for margin={margin:g}; "
                "omit margin"
            )
        layer.bias.data[int(np.argmin(demands))] -= margin

    def make_inputs(self) -> PolicyInputs:
        """Return the inputs of the policy in one environment."""
        names = tuple(self.network.observation_space.spaces)
        return make_inputs(self.card.features, names, self._normalizer)

    @property
    def camera(self) -> "CameraSpec":
        """Cameras of the training."""
        return self.card.camera

    @property
    def neuron(self) -> "NeuronSpec":
        """Neuron parameters of the training."""
        return self.card.neuron

    @property
    def include_frame(self) -> bool:  # type: ignore[override]
        """Whether camera frames are among the inputs."""
        return FRAME in self.features.inputs

    @property
    def reads_neuron(self) -> bool:  # type: ignore[override]
        """Whether outputs of neurons are among the inputs."""
        return any(name not in NOT_NEURONS for name in self.features.inputs)

    @property
    def alert(self) -> bool:
        """Whether the policy brakes; the alerts of individual neurons are not used."""
        return self._demand < 0.0

    def reset(self, seed: int | None = None) -> None:
        """Clear the history and release the brake."""
        super().reset(seed)
        self._inputs.reset()
        self._decisions = 0
        self._demand = 0.0

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Return a new demand at every `repeat`-th call, else the last one; hold a latched demand."""
        if self.features.latches(self._demand):
            return self._demand
        self._inputs.update(observation)
        if self._decisions % self.features.repeat == 0:
            self._demand = self.decide(self._inputs.stack())
        self._decisions += 1
        return self._demand

    def decide(self, inputs: dict[str, np.ndarray]) -> float:
        """Return the demand for the inputs of one decision."""
        action, _ = self.network.predict(inputs, deterministic=True)
        demands = self.card.demands
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


def _count(camera: "CameraSpec") -> int:
    """Return the number of cameras."""
    return len(camera) if isinstance(camera, list | tuple) else 1


def _load_network(path: Path, card: PolicyCard) -> Any:
    try:
        import stable_baselines3
        import torch
    except ImportError:
        raise missing_extra("a policy", "train") from None
    torch.set_num_threads(1)  # small network; episodes run in parallel processes; see `Policy`
    try:
        if card.network is not None:
            return card.network.load(path, card.algo, len(card.demands) if card.demands else None)
        announce_pickle(path)
        return getattr(stable_baselines3, card.algo.upper()).load(path, device="cpu").policy
    except Exception as error:  # of the archive, pickle, PyTorch or stable-baselines3
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise ValueError(
            f"policy {shown(str(path))} cannot be loaded with algo {shown(card.algo)} ({reason}); "
            "correct its card, or train it again"
        ) from None
