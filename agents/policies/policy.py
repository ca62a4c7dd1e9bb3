"""`Policy`: a stable-baselines3 model as an agent."""

import copy
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from functools import cached_property, partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from lgmd_gym.agents.base import FPS, Infos, Observations, StagedAgent, State
from lgmd_gym.agents.policies.card import PolicyCard, policy_card
from lgmd_gym.agents.policies.dense import DenseNetwork, Step, load_steps, with_margin
from lgmd_gym.agents.policies.features import (
    FRAME,
    SCALES,
    ZONE_INPUTS,
    FeatureConfig,
    FeatureHistory,
    announce_pickle,
    check_zone_shape,
    load_normalizer,
)
from lgmd_gym.agents.policies.network import dense_layers, dense_steps, layer_values
from lgmd_gym.agents.stages import Evidence
from lgmd_gym.errors import check_path, check_text, check_within, shown, unknown_name
from lgmd_gym.processes.extras import missing_extra

if TYPE_CHECKING:
    from lgmd_gym.neuron import NeuronSpec
    from lgmd_gym.sensing.channel import ChannelSpec

NOT_NEURONS = (FRAME, "ego_speed", "speed_change", "ego_yaw_rate", "ego_acceleration", "known_deceleration")
RAW_INPUTS = (*SCALES, FRAME)  # observations of `LGMDObservation`
SHIPPED = Path(__file__).parent  # folder of the policies in this package
MAX_MARGIN = 20.0  # of log odds; the sensible range is about -4 to 4
# The outputs of a network that torch runs depend on the size of the batch, because the order of float32 sums
# does. The differences are near 1e-6. A lead of the best action beyond this limit does not depend on them.
SAFE_LEAD = 1e-3
FADE_S = 0.5  # time for which the car may decelerate after the agent released the brake
DRIVER_HOLD_S = 0.3  # time for which a braking driver counts as such: decelerations fluctuate


ActionValues: TypeAlias = Callable[[dict[str, np.ndarray]], np.ndarray | None]
"""Function from inputs of shape (N, …) to values of the actions, shape (N, actions); None without values."""


class PolicyInputs(Protocol):
    """Inputs of a policy in N environments; `FeatureHistory` is one."""

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Begin new episodes."""
        ...

    def update(self, observations: Observations, rows: np.ndarray | None = None) -> None:
        """Process the observations of a decision of some environments."""
        ...

    def stack(self, rows: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return the inputs of a decision of the policy in some environments."""
        ...


class RawInputs:
    """Observations as the environment returns them.

    Args:
        names: Names of the observations.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names
        self._observations: Observations = {}

    def reset(self, mask: np.ndarray | None = None) -> None:
        """Do nothing: there is no history."""

    def update(self, observations: Observations, rows: np.ndarray | None = None) -> None:
        """Keep observations of `LGMDObservation`."""
        self._observations = observations

    def stack(self, rows: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return the last observations."""
        selected = slice(None) if rows is None else rows
        return {name: np.array(self._observations[name][selected]) for name in self._names}


class NormalizedInputs:
    """Inputs with the statistics of a `VecNormalize`, which do not change.

    Args:
        inputs: Inputs of the training environment within the `VecNormalize`.
        normalizer: A `Normalizer` or `VecNormalize`.
    """

    def __init__(self, inputs: PolicyInputs, normalizer: Any) -> None:
        self._inputs, self._normalizer = inputs, normalizer
        self.reset, self.update = inputs.reset, inputs.update

    def stack(self, rows: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """Return the normalised inputs."""
        return self._normalizer.normalize_obs(self._inputs.stack(rows))


class Policy(StagedAgent):
    """Agent that acts with a trained stable-baselines3 model, without exploration.

    The network runs once for all environments, and demands do not depend on N: `DenseNetwork` calculates most
    networks in a fixed order. Others run for each environment by itself where the two best actions are almost
    equal, and for continuous actions.

    With a card that has a `brake`, the actions are intervals of the time to brake, and the brake has stages,
    see `TimeToBrakeParams`. Otherwise they are demands.

    The file is a model of stable-baselines3 with a card (`PolicyCard`), inside it or beside it: the cameras,
    features and demands. With a card that describes the network, as of `lgmd-gym train`, loading reads the
    weights only. Other files are unpickled, which can execute any code: load only those that you trust.

    A described network of dense layers from vectors to discrete actions, as `all-round`, is loaded without
    PyTorch. Other networks require the extra `train`, and loading them sets the number of PyTorch's threads
    in the process to 1, see `torch.set_num_threads`.

    Args:
        path: Zip file, or name of a policy in this package.
        margin: Log odds of braking above which the policy brakes, in [-20, 20]; not 0 only for a policy that
            chooses one of two demands by their probabilities, or whose brake has stages. Above 0, the policy
            warns and brakes later and less often: it has fewer false activations and avoids fewer contacts.

    Attributes:
        card: The card.
        features: Inputs of the policy and its decision rate.

    Raises:
        ValueError: If the file cannot be read or has no card, if the card has other fields or columns than
            the inputs require, if the network requires stable-baselines3 and it is not installed, or for a
            margin that is out of range or not supported.
    """

    name = "policy"

    def __init__(self, path: str, margin: float = 0.0) -> None:
        self.name = f"policy:{check_text('path', path)}"
        check_within("margin", margin, -MAX_MARGIN, MAX_MARGIN)
        file = self._file = find_policy(path)
        card = self.card = policy_card(file)
        _check_fields(file, card)
        self._margin = margin
        steps = _described_steps(file, card)
        if steps is None or card.network is None:
            space, num_actions = self.network.observation_space, getattr(self.network.action_space, "n", None)
        else:
            space, num_actions = card.network.observation_space, card.num_actions
        self._names: tuple[str, ...] = tuple(getattr(space, "spaces", ()))
        self._check_network(space, num_actions)
        if card.brake is not None:
            self.brake = card.brake
        elif margin != 0.0 and steps is not None:
            steps = with_margin(steps, self._braking_action(card.algo.lower() != "dqn"), margin)
        if margin != 0.0:
            self.name += f":margin={margin:.12g}"
        raw = FeatureConfig(inputs=self._names, history=1, repeat=1, shrink=1)
        self.features = raw if card.features is None else card.features
        name = card.vec_normalize
        self._normalizer = None if name is None else load_normalizer(file.parent / name)
        if steps is None:
            self._values: ActionValues = _torch_values(self.network, self._names)
        else:
            self._values = DenseNetwork(steps, self._names)
        self._independent = isinstance(self._values, DenseNetwork)
        super().__init__()

    @cached_property
    def network(self) -> Any:
        """The policy of stable-baselines3, a `BasePolicy`, whose bias includes the margin.

        It is loaded when it is first read, which requires the extra `train`. Decisions do not use that of
        most policies, see `DenseNetwork`: a change of its weights has no effect on them.

        Raises:
            ValueError: If stable-baselines3 is not installed.
        """
        network = load_network(self._file, self.card)
        if self._margin != 0.0 and self.card.brake is None:
            action = self._braking_action(hasattr(network, "action_net"))
            network.action_net.bias.data[action] -= self._margin
        return network

    def _check_network(self, space: Any, num_actions: int | None) -> None:
        """Raise ValueError unless inputs, cameras and actions of the network are those of the card."""
        card, names = self.card, self._names
        expected = set(names) & set(RAW_INPUTS) if card.features is None else set(card.features.inputs)
        faults: list[str] = []
        if set(names) != expected or not names:
            faults.append(f"inputs {', '.join(names) or space} instead of {', '.join(sorted(expected))}")
        if num_actions != card.num_actions:
            given, required = num_actions or "continuous", card.num_actions or "continuous"
            faults.append(f"{given} actions instead of {required}")
        for name in (item for item in names if item in ZONE_INPUTS):
            if space[name].shape != (ZONE_INPUTS[name].size,):
                faults.append(f"{space[name].shape[0]} values of {name} instead of {ZONE_INPUTS[name].size}")
        if not faults and card.features is None and "spike_frequency" in names:
            cameras = space["spike_frequency"].shape[0], _count(card.camera)
            faults += [f"{cameras[0]} cameras instead of {cameras[1]}"] if cameras[0] != cameras[1] else []
        if faults:
            raise ValueError(
                f"policy {str(self._file)!r}: model and card do not belong together: the model has "
                f"{'; '.join(faults)}; correct the card, or train it again"
            )

    def _braking_action(self, has_odds: bool) -> int:
        """Return the action whose log odds a margin reduces; `has_odds`: whether actions have them."""
        demands = self.card.demands
        if demands is None or len(demands) != 2 or not has_odds:
            raise ValueError(
                f"{self.name} must have two demands and action probabilities for margin={self._margin:g}; "
                "omit margin"
            )
        return int(np.argmin(demands))

    @property
    def camera(self) -> "ChannelSpec":
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

    def initial(self) -> State:
        """Return a released brake, the number of decisions, and times since agent and driver braked."""
        times = {"braked_s": inf, "driver_s": inf}
        return super().initial() | {"demand": 0.0, "decisions": 0, "evidence": int(Evidence.CLEAR)} | times

    def reset(
        self, mask: np.ndarray | None = None, seeds: Sequence[int | None] | np.ndarray | None = None
    ) -> None:
        """Clear the histories and release the brakes."""
        super().reset(mask, seeds)
        self._inputs.reset(mask)

    def demands(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return new demands at every `repeat`-th call, else the last ones; hold latched demands.

        The alerts are the stages from the warning on, or else the activations of the brake; those of
        individual neurons are not used.
        """
        if self.card.brake is not None:
            return super().demands(observations, infos, active)
        demands, decisions = self.state["demand"], self.state["decisions"]
        rows = np.flatnonzero(active & ~self.features.latches(demands))
        if len(rows):
            self._inputs.update(observations, rows)
            due = rows[decisions[rows] % self.features.repeat == 0]
            if len(due):
                demands[due] = self.decide(self._inputs.stack(due))
            decisions[rows] += 1
        self.alerts = demands < 0.0
        return demands

    def evidence(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return new evidence at every `repeat`-th call, else the last one."""
        evidence, decisions, rows = self.state["evidence"], self.state["decisions"], np.flatnonzero(active)
        self._inputs.update(observations, rows)
        driver_brakes = self._driver_brakes(observations, rows)
        is_due = decisions[rows] % self.features.repeat == 0
        if is_due.any():
            due = rows[is_due]
            evidence[due] = self._judge(self._inputs.stack(due), driver_brakes[is_due])
        decisions[rows] += 1
        return evidence

    def _driver_brakes(self, observations: Observations, rows: np.ndarray) -> np.ndarray:
        """Return whether the drivers of some environments brake, bool, shape (M,); once per decision.

        They do if the ego decelerates, up to 0.3 s after that, but not during braking by the agent and 0.5 s
        after it, when the brake still fades.
        """
        brake = self.card.brake
        assert brake is not None
        if brake.driver_odds == 0.0:
            return np.zeros(len(rows), np.bool_)
        braked_s, driver_s = (self.state[name][rows] + 1.0 / FPS for name in ("braked_s", "driver_s"))
        braked_s[self.state["stage"][rows] >= Evidence.PARTIAL] = 0.0
        decelerates = observations["ego_acceleration"][rows, 0] <= -brake.driver_deceleration
        driver_s[decelerates] = 0.0
        driver_s[braked_s <= FADE_S] = inf
        self.state["braked_s"][rows], self.state["driver_s"][rows] = braked_s, driver_s
        return driver_s <= DRIVER_HOLD_S

    def _judge(self, inputs: dict[str, np.ndarray], driver_brakes: np.ndarray) -> np.ndarray:
        """Return the evidence for the inputs of several environments, arrays of shape (M, …)."""
        brake, logits = self.card.brake, self._values(inputs)
        assert brake is not None
        assert logits is not None  # the card was compared with the network
        evidence, safe = brake.evidence(brake.odds(logits), self._margin, driver_brakes)
        if len(evidence) > 1 and not self._independent:
            for row in np.flatnonzero(~safe).tolist():  # see `SAFE_DISTANCE`
                alone = {name: values[row : row + 1] for name, values in inputs.items()}
                evidence[row] = self._judge(alone, driver_brakes[row : row + 1])[0]
        return evidence

    def decide(self, inputs: dict[str, np.ndarray]) -> list[float]:
        """Return the demands for the inputs of several environments, arrays of shape (M, …)."""
        count = len(next(iter(inputs.values())))
        values = self._values(inputs) if self.card.demands and count > 1 else None
        if values is None or values.shape[1] < 2:
            return [self._decide_alone(inputs, row) for row in range(count)]
        demands: list[float] = list(self.card.demands or ())
        if self._independent:
            return [demands[action] for action in values.argmax(axis=1).tolist()]
        second, best = np.sort(values, axis=1)[:, -2:].T
        safe = best - second > SAFE_LEAD * np.maximum(1.0, np.abs(values).max(axis=1))
        actions = zip(values.argmax(axis=1).tolist(), safe.tolist(), strict=True)
        return [
            demands[action] if certain else self._decide_alone(inputs, row)
            for row, (action, certain) in enumerate(actions)
        ]

    def _decide_alone(self, inputs: dict[str, np.ndarray], row: int) -> float:
        """Return the demand for the inputs of one environment, by themselves."""
        demands = self.card.demands
        if demands:
            values = self._values({name: values[row : row + 1] for name, values in inputs.items()})
            if values is not None:
                return demands[int(values[0].argmax())]
        alone = {name: values[row] for name, values in inputs.items()}
        action, _ = self.network.predict(alone, deterministic=True)
        return demands[int(action)] if demands else float(np.reshape(action, -1)[0])

    def _allocate(self, num_envs: int) -> None:
        super()._allocate(num_envs)
        features = self.card.features
        inputs = RawInputs(self._names) if features is None else FeatureHistory(features, num_envs)
        self._inputs: PolicyInputs = inputs
        if self._normalizer is not None:
            self._inputs = NormalizedInputs(inputs, self._normalizer)


def action_values(network: Any, inputs: dict[str, np.ndarray]) -> np.ndarray | None:
    """Return the values that a stable-baselines3 policy maximises over its discrete actions.

    Args:
        network: A policy with discrete actions.
        inputs: Batch of observations.

    Returns:
        Logits or Q values, shape (N, actions), or None if the policy has neither.
    """
    import torch

    with torch.no_grad():
        network.set_training_mode(False)
        tensors, _ = network.obs_to_tensor(inputs)
        if hasattr(network, "q_net"):
            return network.q_net(tensors).numpy()
        if hasattr(network, "get_distribution"):
            return network.get_distribution(tensors).distribution.logits.numpy()
    return None


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


def _check_fields(path: Path, card: PolicyCard) -> None:
    """Raise ValueError unless the cameras of a card have the fields and columns that its inputs require."""
    from lgmd_gym.sensing.channel import make_channels  # imports numba, which takes half a second

    inputs = () if card.features is None else card.features.inputs
    channels = make_channels(card.camera)
    for name in (item for item in inputs if item in ZONE_INPUTS):
        has_columns = ZONE_INPUTS[name].source == "column_potential"
        count = sum(channel.columns for channel in channels) if has_columns else len(channels)
        try:
            check_zone_shape(name, (count,))
        except ValueError as error:
            raise ValueError(f"policy {shown(str(path))}: {error}") from None


def _count(camera: "ChannelSpec") -> int:
    """Return the number of cameras."""
    return len(camera) if isinstance(camera, list | tuple) else 1


def load_network(path: Path, card: PolicyCard) -> Any:
    """Return the network in a policy file, a `BasePolicy`.

    Raises:
        ValueError: If stable-baselines3 is not installed, or the file is damaged or does not fit its card.
    """
    try:
        import stable_baselines3
        import torch
    except ImportError:
        raise missing_extra("a policy", "train") from None
    torch.set_num_threads(1)  # small network; episodes run in parallel processes; see `Policy`
    with _explained(path, card):
        if card.network is not None:
            return copy.deepcopy(_remembered(_described_network, path, card))  # a margin changes it
        announce_pickle(path)
        network = getattr(stable_baselines3, card.algo.upper()).load(path, device="cpu").policy
        network.set_training_mode(False)
        return network


def _torch_values(network: Any, names: tuple[str, ...]) -> ActionValues:
    """Return the function that calculates the values of the actions of a `BasePolicy`."""
    layers = dense_layers(network)
    if layers is None:
        return partial(action_values, network)
    steps = dense_steps(layers)
    return partial(layer_values, layers, names) if steps is None else DenseNetwork(steps, names)


def _described_steps(path: Path, card: PolicyCard) -> list[Step] | None:
    """Return the steps of a `DenseNetwork` that a card describes; None if only PyTorch can load it.

    Raises:
        ValueError: If the file is damaged or does not fit its card.
    """
    with _explained(path, card):
        return None if card.network is None else _remembered(_load_steps, path, card)


def _load_steps(path: Path, card: PolicyCard) -> list[Step] | None:
    assert card.network is not None
    return load_steps(card.network, path, card.algo, card.num_actions)


def _described_network(path: Path, card: PolicyCard) -> Any:
    assert card.network is not None
    return card.network.load(path, card.algo, card.num_actions)


@contextmanager
def _explained(path: Path, card: PolicyCard) -> Generator[None, None, None]:
    """Raise ValueError of one line for any error of the archive, pickle, PyTorch or stable-baselines3."""
    try:
        yield
    except Exception as error:
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise ValueError(
            f"policy {shown(str(path))} cannot be loaded with algo {shown(card.algo)} ({reason}); "
            "correct its card, or train it again"
        ) from None


_LOADED: dict[tuple[object, ...], Any] = {}  # the last results
_MAX_LOADED = 8


def _remembered(load: Callable[[Path, PolicyCard], Any], path: Path, card: PolicyCard) -> Any:
    """Return `load(path, card)`, which the caller must not change.

    The last results are remembered: a benchmark makes an agent per episode, and PyTorch loads for half a
    second.
    """
    state = path.stat()
    key = (load, path.resolve(), state.st_mtime_ns, state.st_size, repr(card))
    try:  # not `in`, because another thread may clear it
        return _LOADED[key]
    except KeyError:
        found = load(path, card)
    if len(_LOADED) >= _MAX_LOADED:
        _LOADED.clear()
    _LOADED[key] = found
    return found
