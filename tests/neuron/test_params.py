import dataclasses
import math
import re

import pytest
from support.neurons import PRESETS

from lgmd_gym.neuron import LGMDParams


def test_literal_preset_differs_in_three_fields():
    changed = {"spikes_from": "membrane", "extra_frame": True, "warm_start": False}
    assert LGMDParams.literal().to_dict() == LGMDParams().to_dict() | changed
    assert (LGMDParams().window, LGMDParams.literal().window) == (6, 7)


def test_persistence_follows_equation_1():
    assert LGMDParams(n_p=3).persistence == pytest.approx([0.268941, 0.119203, 0.047426], abs=1e-6)
    assert LGMDParams(n_p=0).persistence == ()


@pytest.mark.parametrize("name", PRESETS)
def test_toml_and_dict_round_trip(name, tmp_path):
    params = PRESETS[name]
    params.to_toml(tmp_path / "p.toml")
    assert LGMDParams.from_toml(tmp_path / "p.toml") == params
    assert LGMDParams.make(params.to_dict()) == params


def test_partial_toml_file_keeps_the_other_defaults(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("# a narrower filter\nt_sp = 1\ntau_2 = [60, 100, inf]\n")
    assert LGMDParams.from_toml(path) == LGMDParams(t_sp=1.0, tau_2=(60.0, 100.0, math.inf))


def test_unknown_key_suggests_the_closest_one(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("t_spp = 0.7\n")
    with pytest.raises(ValueError, match=r"unknown LGMD field 't_spp'; did you mean 't_sp'\?"):
        LGMDParams.from_toml(path)


def test_error_for_an_invalid_toml_file_contains_its_path(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("t_sp: 0.7\n")
    with pytest.raises(ValueError, match=r"p\.toml' must be a TOML file"):
        LGMDParams.from_toml(path)


def test_params_are_hashable_and_frozen():
    assert {LGMDParams(t_sp=0.5): 1}[LGMDParams(t_sp=0.5)] == 1
    assert LGMDParams(tau_2=[60, 120, 180]) == LGMDParams()  # pyright: ignore[reportArgumentType]
    assert len(set(PRESETS.values())) == len(PRESETS)
    with pytest.raises(dataclasses.FrozenInstanceError):
        LGMDParams().t_sp = 0.5  # pyright: ignore[reportAttributeAccessIssue]


NUMBERS = [f.name for f in dataclasses.fields(LGMDParams) if not isinstance(f.default, bool | str)]


@pytest.mark.parametrize("value", [-1.0, math.nan, "0.5", None, True])
def test_every_number_is_checked(value):
    for name in NUMBERS:
        is_tuple = isinstance(getattr(LGMDParams(), name), tuple)
        with pytest.raises((ValueError, TypeError), match=rf"{name} must be .*, got"):
            LGMDParams(**{name: (value,) * 3 if is_tuple else value})


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ({"t_f": 0.0}, "LGMD t_f must be in (0, inf] grey levels, got 0.0"),
        ({"t_sp": 1.5}, "LGMD t_sp must be in [0, 1], got 1.5"),
        ({"t_de": math.inf}, "LGMD t_de must be finite, got inf"),
        ({"n_p": 2.5}, "LGMD n_p must be a whole number in [0, 16], got 2.5"),
        ({"n_ts": 0}, "LGMD n_ts must be in [1, 256] frames, got 0"),
        ({"weights": (1.0, 2.0)}, "LGMD weights must be 3 numbers, got (1.0, 2.0)"),
        ({"delay": "none"}, "unknown LGMD delay 'none'; known: recursive, two-tap"),
        ({"warm_start": 1}, "LGMD warm_start must be true or false, got 1"),
        ({"u": 0.0}, "must sum to < 1, got 1 from u = 0 and n_p = 2; raise u or lower n_p"),
    ],
)
def test_error_contains_field_bound_and_value(field, message):
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        LGMDParams(**field)
