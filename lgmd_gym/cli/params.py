"""Reading of the `--params` option."""

from pathlib import Path
from typing import Any

from lgmd_gym.neuron import LGMDParams


def read_params(path: Path | None) -> dict[str, Any] | None:
    """Return the LGMD parameters in a TOML file as plain values, or None for no file.

    Raises:
        ValueError: If the file cannot be read or holds an unknown parameter.
    """
    if path is None:
        return None
    try:
        return LGMDParams.from_toml(path).to_dict()
    except OSError as error:
        raise ValueError(f"params file {str(path)!r} cannot be read: {error.strerror}") from None
