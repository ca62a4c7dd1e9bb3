"""Reading of TOML and JSON files."""

import json
import tomllib
from pathlib import Path
from typing import Any


def read_data(path: Path, kind: str) -> dict[str, Any]:
    """Return the values of a TOML file, or of a JSON file if its name ends in ".json".

    Args:
        path: File to read.
        kind: Kind of file, for the message.

    Raises:
        ValueError: If it cannot be read, is not TOML or JSON, or states a key twice.
    """
    is_json = path.suffix == ".json"
    try:
        text = path.read_text(encoding="utf-8")
        values = json.loads(text, object_pairs_hook=_unique) if is_json else tomllib.loads(text)
    except OSError as error:
        raise ValueError(f"{kind} {str(path)!r} cannot be read: {error.strerror}") from None
    except ValueError as error:  # also of the decoders of TOML, JSON and UTF-8
        raise ValueError(f"{kind} {str(path)!r} is not {'JSON' if is_json else 'TOML'}: {error}") from None
    if not isinstance(values, dict):
        raise ValueError(f"{kind} {str(path)!r} must contain an object {{...}}, got {type(values).__name__}")
    return values


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object; the JSON module silently keeps the last of several values of a key."""
    values: dict[str, Any] = {}
    for key, value in pairs:
        if key in values:
            raise ValueError(f"key {key!r} is stated twice")
        values[key] = value
    return values
