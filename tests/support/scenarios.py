"""Checks of scenarios as data."""

import pytest

from lgmd_gym.envs.families.family import make_scenario

CAR = {"kind": "car", "length": 4.023, "width": 1.712, "height": 1.427, "shade": None}
STILL = {"speed": 0.0, "heading": 0.0, "lateral_offset": 0.0, "profile": (), "path": ()}


def check_actor(actor, **expected):
    """Assert the fields of an actor; the others are those of a stationary target car."""
    for name, value in (CAR | STILL | expected).items():
        found = getattr(actor, name)
        assert found == (pytest.approx(value) if isinstance(value, float) else value), name


def scenario(name, **arguments):
    """Return the scenario after checking that its family is its name."""
    made = make_scenario(name, **arguments)
    assert made.family == name
    return made


def shape(bends):
    """Return length, first and last curvature of each bend."""
    return [pytest.approx((bend.length, bend.curvature, bend.last_curvature)) for bend in bends]


def invalid(name, message, **arguments):
    """Assert that the arguments of a family are rejected."""
    with pytest.raises(ValueError, match=message):
        make_scenario(name, **arguments)
