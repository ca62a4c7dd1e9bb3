"""Inputs of a policy at each decision: features, raw observations, and the normalisation of the training."""

import pickle
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from lgmd_gym.agents.policies.features import FeatureConfig, FeatureHistory
from lgmd_gym.errors import shown


class PolicyInputs(Protocol):
    """Inputs of a policy in one environment; `FeatureHistory` is one."""

    def reset(self) -> None:
        """Begin a new episode."""
        ...

    def update(self, observation: dict[str, Any]) -> None:
        """Process the observation of a decision of the environment."""
        ...

    def stack(self) -> dict[str, np.ndarray]:
        """Return the inputs of a decision of the policy."""
        ...


class RawInputs:
    """Observations as the environment returns them.

    Args:
        names: Names of the observations.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names
        self.reset()

    def reset(self) -> None:
        """Forget the last observation."""
        self._observation: dict[str, Any] = {}

    def update(self, observation: dict[str, Any]) -> None:
        """Keep an observation of `LGMDObservation`."""
        self._observation = observation

    def stack(self) -> dict[str, np.ndarray]:
        """Return the last observation."""
        return {name: np.array(self._observation[name]) for name in self._names}


class NormalizedInputs:
    """Inputs with the statistics of a `VecNormalize`, which do not change.

    Args:
        inputs: Inputs of the training environment within the `VecNormalize`.
        normalizer: A `VecNormalize`.
    """

    def __init__(self, inputs: PolicyInputs, normalizer: Any) -> None:
        self._inputs, self._normalizer = inputs, normalizer
        self.reset, self.update = inputs.reset, inputs.update

    def stack(self) -> dict[str, np.ndarray]:
        """Return the normalised inputs."""
        return self._normalizer.normalize_obs(self._inputs.stack())


def make_inputs(features: FeatureConfig | None, names: tuple[str, ...], normalizer: Any) -> PolicyInputs:
    """Return the inputs of one environment.

    Args:
        features: Features of the policy; None for raw observations.
        names: Names of the raw observations.
        normalizer: A `VecNormalize`, or None.
    """
    inputs = RawInputs(names) if features is None else FeatureHistory(features)
    return inputs if normalizer is None else NormalizedInputs(inputs, normalizer)


def load_normalizer(path: Path) -> Any:
    """Return the `VecNormalize` in a file, which is unpickled.

    Raises:
        ValueError: If the file cannot be read or holds something else.
    """
    try:
        normalizer: Any = pickle.loads(path.read_bytes())
    except OSError as error:
        raise ValueError(f"vec_normalize {shown(str(path))} cannot be read: {error.strerror}") from None
    except Exception as error:  # any exception of the unpickled code
        raise ValueError(f"vec_normalize {shown(str(path))} cannot be loaded ({error})") from None
    if not isinstance(normalizer, Mapping) and hasattr(normalizer, "normalize_obs"):
        normalizer.training = False
        return normalizer
    raise ValueError(f"vec_normalize {shown(str(path))} must be a file of VecNormalize.save")
