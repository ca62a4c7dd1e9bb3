"""Scenarios as plain data: dicts, lists, strings and numbers, as read from TOML or JSON.

[scenario]
family = "mine"
ego_speed = 12.0                       # arguments as in `Scenario`, in SI units
duration = 9.0

[[scenario.actors]]                    # as in `Actor`
gap = 45.0
speed = 3.0
profile = [{ start = 1.0, acceleration = -2.0 }]
path = [{ length = 20.0, curvature = 0.05 }]
"""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, cast

import numpy as np

from lgmd_gym.aliases import Values
from lgmd_gym.envs.dynamics.script import Bend, Segment
from lgmd_gym.envs.families.scenario import Actor, RoadPlan, Scenario
from lgmd_gym.errors import check_keys, check_type

# Fields that contain further dataclasses, and whether they contain several.
_NESTED: dict[tuple[type, str], tuple[type, bool]] = {
    (Scenario, "actors"): (Actor, True),
    (Scenario, "ego_profile"): (Segment, True),
    (Scenario, "ego_path"): (Bend, True),
    (Scenario, "road"): (RoadPlan, False),
    (Actor, "profile"): (Segment, True),
    (Actor, "path"): (Bend, True),
    (RoadPlan, "bends"): (Bend, True),
}


def scenario_to_data(scenario: Scenario) -> Values:
    """Return a scenario as plain data, without the fields that have their default."""
    return _to_data(check_type("scenario", scenario, Scenario))


def scenario_from_data(data: Mapping[str, object] | Scenario) -> Scenario:
    """Return the scenario of plain data; a `Scenario` is returned as it is.

    Args:
        data: Fields of `Scenario`; its actors, bends, segments and road as dicts with their fields.

    Raises:
        ValueError: If a key is unknown or missing, or a value is out of range; the message contains the
            place, such as `scenario.actors[1].profile[0]`.
    """
    return data if isinstance(data, Scenario) else _from_data(Scenario, data, "scenario")


def _to_data(item: Any) -> Values:
    data: Values = {}
    for field in fields(item):
        value = getattr(item, field.name)
        default = field.default_factory() if field.default_factory is not MISSING else field.default
        if value == default:
            continue
        if (type(item), field.name) in _NESTED:
            several = _NESTED[type(item), field.name][1]
            data[field.name] = [_to_data(part) for part in value] if several else _to_data(value)
        else:
            data[field.name] = value.item() if isinstance(value, np.generic) else value
    return data


def _from_data(kind: type, data: object, place: str) -> Any:
    """Return an instance of a dataclass; `place` is for messages."""
    given = check_type(place, data, dict)
    check_keys(f"key of {place}", given, [field.name for field in fields(kind)])
    for field in fields(kind):
        required = field.default is MISSING and field.default_factory is MISSING
        if required and field.name not in given:
            raise ValueError(f"{place} must have the key {field.name!r}; add it")
    values = {}
    for name, value in given.items():
        nested, several = _NESTED.get((kind, name), (None, False))
        inner = f"{place}.{name}"
        if nested is None:
            values[name] = value
        elif several:
            parts = cast(Sequence[object], check_type(inner, value, list, tuple))
            values[name] = tuple(_from_data(nested, part, f"{inner}[{i}]") for i, part in enumerate(parts))
        else:
            values[name] = _from_data(nested, value, inner)
    try:
        return kind(**values)
    except ValueError as error:
        raise ValueError(f"{place}: {error}") from None
