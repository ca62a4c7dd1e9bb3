"""Parameters of rules: frozen dataclasses whose fields know their bounds, made from strings or TOML."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from lgmd_gym.agents.options import positive, whole
from lgmd_gym.errors import check_keys


def above_zero(default: float, low: float, high: float, *, places_eye: bool = False) -> Any:
    """Return a field for a number > 0; `low` to `high` is what tuning searches.

    Args:
        default: The default.
        low: Lowest value that tuning tries.
        high: Highest one.
        places_eye: Whether the rule's cameras depend on it; tuning then leaves it alone, since all that was
            seen would have to be seen anew.
    """
    metadata = {"check": positive, "range": (low, high), "places_eye": places_eye}
    return field(default=default, metadata=metadata)


def count(default: int, low: int, high: int) -> Any:
    """Return a field for a whole number >= 1; `low` to `high` is what tuning searches."""
    return field(
        default=default, metadata={"check": lambda name, value: whole(name, value, 1), "range": (low, high)}
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleParams:
    """Base of the parameters of all rules; every field is made by `above_zero` or `count`."""

    def __post_init__(self) -> None:
        for item in fields(self):
            checked = item.metadata["check"](item.name, getattr(self, item.name))
            object.__setattr__(self, item.name, checked)

    @classmethod
    def from_options(cls, agent: str, options: Mapping[str, Any]) -> Self:
        """Build from options as in an agent's string; `toml` names a file of further ones.

        Args:
            agent: The agent's name, for the message.
            options: By name; they go over those of the file, and what is missing keeps its default.

        Raises:
            ValueError: For an unknown option, naming the nearest, a value out of bounds, or a file that
                cannot be read.
        """
        given = dict(options)
        if "toml" in given:
            given = {**_read(given.pop("toml")), **given}
        check_keys(f"option of agent {agent}", given, [*(item.name for item in fields(cls)), "toml"])
        return cls(**given)


def _read(path: Any) -> dict[str, Any]:
    try:
        return tomllib.loads(Path(str(path)).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"agent file {str(path)!r} cannot be read: {error.strerror}") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"agent file {str(path)!r} is not TOML: {error}") from None
