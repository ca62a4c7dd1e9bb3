"""Reading of the options `--params`, `--set` and `--world`."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from lgmd_gym.agents import Agent
from lgmd_gym.camera.worlds import LABORATORY, check_world
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


def note_unused_params(path: Path | None, agents: Iterable[Agent]) -> None:
    """Print a line to stderr for agents whose braking the parameters do not change."""
    names = [agent.name for agent in agents if not agent.reads_neuron]
    if path is not None and names:
        print(
            f"lgmd-gym: --params {path} does not change the braking of {', '.join(names)}, which does not "
            "depend on the neuron",
            file=sys.stderr,
        )


def parse_arguments(pairs: tuple[str, ...]) -> dict[str, Any]:
    """Return NAME=NUMBER pairs as a dict."""
    arguments: dict[str, Any] = {}
    for pair in pairs:
        name, _, value = pair.partition("=")
        try:
            arguments[name] = int(value) if name == "shade" else float(value)
        except ValueError:
            raise ValueError(f"--set must be NAME=NUMBER, for example ego_speed=8.3, got {pair!r}") from None
    return arguments


def parse_world(text: str | None) -> dict[str, Any]:
    """Return the argument `world` of an environment, or {} for None.

    Raises:
        ValueError: If there is no such world.
    """
    if text is None:
        return {}
    world = check_world(int(text) if text.lstrip("-").isdecimal() else text)
    return {"world": LABORATORY if world is None else world}
