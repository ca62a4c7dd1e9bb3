"""Normalisation of a policy's inputs: the statistics of a `VecNormalize` of the training."""

import pickle
import sys
from collections.abc import Mapping
from functools import cache
from multiprocessing import current_process
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.errors import shown
from lgmd_gym.processes.files import complete_file

NORMALIZER_SUFFIX = ".npz"


@cache
def announce_pickle(path: Path) -> None:
    """Print once that loading a file executes code in it; worker processes leave it to their parent."""
    if current_process().name == "MainProcess":
        print(f"lgmd-gym: loading {shown(str(path))} executes the pickled code in this file", file=sys.stderr)


class Normalizer:
    """Statistics of a `VecNormalize` as arrays, in a NumPy file.

    Args:
        arrays: `epsilon`, `clip`, and `mean/NAME` and `var/NAME` of each normalised observation.
    """

    def __init__(self, arrays: Mapping[str, np.ndarray]) -> None:
        self._epsilon, self._clip = float(arrays["epsilon"]), float(arrays["clip"])
        self._means = {key[5:]: arrays[key] for key in arrays if key.startswith("mean/")}
        self._variances = {name: arrays[f"var/{name}"] for name in self._means}

    def normalize_obs(self, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return the inputs as `VecNormalize.normalize_obs` does."""
        normalized = dict(inputs)
        for name, mean in self._means.items():
            values = (inputs[name] - mean) / np.sqrt(self._variances[name] + self._epsilon)
            normalized[name] = np.clip(values, -self._clip, self._clip).astype(np.float32)
        return normalized


def save_normalizer(normalizer: Any, path: Path) -> None:
    """Write the statistics of a `VecNormalize` with a `Dict` observation to a NumPy file."""
    arrays: dict[str, Any] = {"epsilon": normalizer.epsilon, "clip": normalizer.clip_obs}
    for name in normalizer.norm_obs_keys if normalizer.norm_obs else ():
        statistics = normalizer.obs_rms[name]
        arrays |= {f"mean/{name}": statistics.mean, f"var/{name}": statistics.var}
    with complete_file(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_normalizer(path: Path) -> Any:
    """Return the statistics in a file of `save_normalizer`; a file of `VecNormalize.save` is unpickled.

    Raises:
        ValueError: If the file cannot be read or holds something else.
    """
    try:
        if path.suffix == NORMALIZER_SUFFIX:
            with np.load(path, allow_pickle=False) as arrays:
                return Normalizer(dict(arrays))
        announce_pickle(path)
        normalizer: Any = pickle.loads(path.read_bytes())
    except OSError as error:
        raise ValueError(f"vec_normalize {shown(str(path))} cannot be read: {error.strerror}") from None
    except Exception as error:  # any exception of the unpickled code
        raise ValueError(f"vec_normalize {shown(str(path))} cannot be loaded ({error})") from None
    if not isinstance(normalizer, Mapping) and hasattr(normalizer, "normalize_obs"):
        normalizer.training = False
        return normalizer
    raise ValueError(f"vec_normalize {shown(str(path))} must be a file of VecNormalize.save")
