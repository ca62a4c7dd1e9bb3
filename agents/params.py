"""Parameters of rules: frozen dataclasses with bounds and search ranges, built from strings or TOML files."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Self

from lgmd_gym.errors import check_keys, check_positive, check_whole, shown


def parameter(default: float, low: float, high: float, *, affects_camera: bool = False) -> Any:
    """Return a dataclass field for a number > 0, or for a whole number >= 1 if the default is an int.

    Args:
        default: Default value.
        low: Lower end of the search range of tuning.
        high: Upper end of the search range of tuning.
        affects_camera: Whether the rule's cameras depend on the value; then tuning searches it on request.
    """
    return field(default=default, metadata={"search_range": (low, high), "affects_camera": affects_camera})


@dataclass(frozen=True, slots=True, kw_only=True)
class RuleParams:
    """Base class of rule parameters; every field is a `parameter`."""

    def __post_init__(self) -> None:
        for item in fields(self):
            name, value = item.name, getattr(self, item.name)
            checked = (
                check_whole(name, value, 1) if isinstance(item.default, int) else check_positive(name, value)
            )
            object.__setattr__(self, name, checked)

    @classmethod
    def from_options(cls, agent: str, options: Mapping[str, Any]) -> Self:
        """Return parameters for the options of an agent string.

        Args:
            agent: Agent name, for error messages.
            options: Values by field name. The key `toml` names a file with further values; values in
                `options` take precedence. Missing fields keep their defaults.

        Raises:
            ValueError: For an unknown option, a value out of bounds, or an unreadable file.
        """
        values = dict(options)
        if "toml" in values:
            values = {**_read_toml(values.pop("toml")), **values}
        check_keys(f"option of agent {agent}", values, [*(item.name for item in fields(cls)), "toml"])
        return cls(**values)


def _read_toml(path: Any) -> dict[str, Any]:
    try:
        return tomllib.loads(Path(str(path)).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"agent file {shown(str(path))} cannot be read: {error.strerror}") from None
    except ValueError as error:  # also of a path with a null character
        raise ValueError(f"agent file {shown(str(path))} is not TOML: {error}") from None
