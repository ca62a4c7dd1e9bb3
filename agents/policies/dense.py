"""Networks of dense layers from vectors to discrete actions: loaded and calculated without PyTorch."""

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self, TypeAlias, cast

import numpy as np

from lgmd_gym.agents.policies.features import FRAME
from lgmd_gym.agents.policies.kernels import affine
from lgmd_gym.agents.policies.weights import read_weights

if TYPE_CHECKING:
    from lgmd_gym.agents.policies.network import NetworkSpec

Shapes: TypeAlias = dict[str, tuple[int, ...]]
"""Shapes of the weights of a network by name."""
Activation: TypeAlias = Callable[..., Any]
"""Function of an array, with the argument `out` of NumPy."""


class Linear(NamedTuple):
    """Layer of sums of weighted inputs. The arrays cannot be written: the agents of a process share them."""

    weights: np.ndarray  # float32, shape (inputs, units)
    bias: np.ndarray  # float32, shape (units,)

    @classmethod
    def of(cls, weights: np.ndarray, bias: np.ndarray) -> Self:
        """Return a layer with copies of weights, shape (units, inputs), and of a bias."""
        layer = cls(np.array(weights.T, np.float32, order="C"), np.array(bias, np.float32))
        for array in layer:
            array.setflags(write=False)
        return layer


Step: TypeAlias = Linear | Activation
"""Step of a `DenseNetwork`."""


def _rectify(values: np.ndarray, out: np.ndarray) -> None:
    """Replace negative values by 0."""
    np.maximum(values, np.float32(0.0), out=out)


ACTIVATIONS: dict[str, Activation] = {"ReLU": _rectify, "Tanh": np.tanh}  # by the name in `torch.nn`
_DEFAULTS = {"ppo": "Tanh", "a2c": "Tanh", "dqn": "ReLU"}  # activations of `MultiInputPolicy`
_ACTOR_CRITIC = ("net_arch", "activation_fn", "ortho_init")  # arguments that are not the extractor's or sde's
_TO_ACTIONS = ("mlp_extractor.policy_net.", "action_net.", "q_net.q_net.")  # layers from inputs to actions


class DenseNetwork:
    """Values of the actions of a network of `Linear`, `ReLU` and `Tanh`.

    This takes half of PyTorch's time for one environment, and the values do not depend on the number of
    environments.

    Args:
        steps: See `load_steps`, and `dense_steps` for a network of stable-baselines3.
        names: Names of the inputs, in the order of the network.
    """

    def __init__(self, steps: Sequence[Step], names: tuple[str, ...]) -> None:
        self._steps, self._names = steps, names

    def __call__(self, inputs: dict[str, np.ndarray]) -> np.ndarray:
        """Return the values of the actions, float32, shape (N, actions).

        Args:
            inputs: Inputs by name, arrays of shape (N, …).

        Raises:
            ValueError: For another number of inputs than that of the network. Kernels do not check it.
        """
        values = side_by_side(inputs, self._names)
        for step in self._steps:
            if isinstance(step, Linear):
                if values.shape[1] != len(step.weights):
                    raise ValueError(
                        f"the policy requires {len(step.weights)} inputs, got {values.shape[1]}; compare the "
                        "cameras and the history of its card with those of its training"
                    )
                out = np.empty((len(values), len(step.bias)), np.float32)
                affine(values, *step, out)
                values = out
            else:
                step(values, out=values)
        return values


def load_steps(spec: "NetworkSpec", path: Path, algo: str, num_actions: int | None) -> list[Step] | None:
    """Return the steps of the `DenseNetwork` in a model file, without PyTorch.

    Args:
        spec: Description of the network.
        path: Model file.
        algo: Algorithm of stable-baselines3, such as "ppo".
        num_actions: Number of discrete actions; None for one continuous demand.

    Returns:
        Steps from the inputs to the values of the actions; None for another network than `dense_shapes`
        knows, or for weights that `read_weights` cannot read.

    Raises:
        ValueError: If the weights are damaged or do not fit the network. Errors of zipfile pass through.
    """
    expected = dense_shapes(spec, algo, num_actions)
    weights = None if expected is None else read_weights(path)
    activation = _activation(spec, algo)
    if expected is None or weights is None or activation is None:
        return None
    check_shapes(expected, shapes_of(weights))
    for name, values in weights.items():
        if not np.isfinite(values).all():
            raise ValueError(f"the weights {name} are not all finite")
    steps: list[Step] = []
    for name in (item.removesuffix("weight") for item in expected if item.endswith(".weight")):
        if name.startswith(_TO_ACTIONS):
            steps += [Linear.of(weights[f"{name}weight"], weights[f"{name}bias"]), activation]
    return steps[:-1]


def dense_shapes(spec: "NetworkSpec", algo: str, num_actions: int | None) -> Shapes | None:
    """Return the shapes of all weights, in the order of stable-baselines3.

    Returns:
        Shapes by name; None for another network than one of `MultiInputPolicy` with `Linear`, `ReLU` and
        `Tanh`, from vectors to discrete actions.
    """
    arguments = ("net_arch", "activation_fn") if algo.lower() == "dqn" else _ACTOR_CRITIC
    if spec.policy != "MultiInputPolicy" or not spec.policy_kwargs.keys() <= {*arguments}:
        return None
    hidden = _hidden(spec.policy_kwargs.get("net_arch"), algo)
    if hidden is None or _activation(spec, algo) is None:
        return None
    if num_actions is None or not spec.inputs or FRAME in spec.inputs:
        return None
    inputs = sum(map(prod, spec.inputs.values()))
    actor, critic = ([inputs, *units] for units in hidden)
    if algo.lower() == "dqn":
        layers = [*actor, num_actions]
        return _stack("q_net.q_net", layers) | _stack("q_net_target.q_net", layers)
    return (
        _stack("mlp_extractor.policy_net", actor)
        | _stack("mlp_extractor.value_net", critic)
        | _linear("action_net", actor[-1], num_actions)
        | _linear("value_net", critic[-1], 1)
    )


def check_shapes(expected: Shapes, given: Shapes) -> None:
    """Raise ValueError unless the weights of a file have the names and shapes of those of its card."""
    for name in [*expected, *given]:
        there, here = given.get(name), expected.get(name)
        if there != here:
            raise ValueError(f"the weights {name} have the shape {there}, those of the card {here}")


def shapes_of(weights: Mapping[str, Any]) -> Shapes:
    """Return the shapes of arrays or tensors by name."""
    return {name: tuple(value.shape) for name, value in weights.items()}


def with_margin(steps: list[Step], action: int, margin: float) -> list[Step]:
    """Return steps with the bias of one action reduced by a margin."""
    last = cast("Linear", steps[-1])
    bias = last.bias.copy()
    bias[action] -= np.float32(margin)
    bias.setflags(write=False)  # the kernel is compiled for such arrays
    return [*steps[:-1], last._replace(bias=bias)]


def side_by_side(inputs: dict[str, np.ndarray], names: tuple[str, ...]) -> np.ndarray:
    """Return inputs of shape (N, …) as one array, float32, shape (N, inputs)."""
    flat = [inputs[name].reshape(len(inputs[name]), -1) for name in names]
    return np.ascontiguousarray(np.concatenate(flat, axis=1, dtype=np.float32))


def _activation(spec: "NetworkSpec", algo: str) -> Activation | None:
    """Return the activation of a network; None for one that only PyTorch has, or another algorithm."""
    default = _DEFAULTS.get(algo.lower())
    name = spec.policy_kwargs.get("activation_fn", default)
    return ACTIVATIONS.get(name) if default is not None and isinstance(name, str) else None


def _hidden(arch: Any, algo: str) -> tuple[Sequence[int], Sequence[int]] | None:
    """Return the units of the hidden layers, to the actions and to the value; None if not whole numbers."""
    if arch is None:
        arch = [64, 64]
    actor: Any = arch
    critic: Any = arch
    if isinstance(arch, dict) and algo.lower() != "dqn":
        networks = cast("dict[str, Any]", arch)
        actor, critic = networks.get("pi", ()), networks.get("vf", ())
    return (actor, critic) if _are_units(actor) and _are_units(critic) else None


def _are_units(units: Any) -> bool:
    return isinstance(units, list | tuple) and all(
        type(item) is int and item > 0 for item in cast("Sequence[Any]", units)
    )


def _stack(name: str, units: Sequence[int]) -> Shapes:
    """Return the shapes of the weights of layers with activations in between."""
    shapes: Shapes = {}
    for index, (before, after) in enumerate(pairwise(units)):
        shapes |= _linear(f"{name}.{2 * index}", before, after)
    return shapes


def _linear(name: str, inputs: int, units: int) -> Shapes:
    return {f"{name}.weight": (units, inputs), f"{name}.bias": (units,)}
