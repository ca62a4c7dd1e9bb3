import dataclasses
import inspect
import math
import re

import pytest
from support.neurons import PRESETS

from lgmd_gym.neuron import LGMDParams


def test_defaults_are_those_of_the_paper():
    p = LGMDParams()
    assert (p.n_p, p.u, p.tau_1) == (2, 1.0, 10.0)
    assert (p.tau_2, p.weights) == ((60.0, 120.0, 180.0), (1.0, 0.25, 0.125))
    assert (p.theta_1, p.theta_2, p.theta_3, p.c_w, p.delta_c, p.c_de, p.t_de) == (1, 1, 1, 4, 0.01, 0.5, 15)
    assert (p.t_f, p.sigma_1, p.sigma_2, p.tau_g, p.sigma_3) == (20, 0.5, 0.01, 10, 1)
    assert (p.tau_s, p.t_sfa, p.sigma_4, p.t_sp, p.n_ts, p.t_sf) == (500, 0.003, 10, 0.7, 6, 30)


def test_released_preset_has_the_values_of_the_released_code():
    p = LGMDParams.released()
    assert (p.n_p, p.on_off_residue, p.delay, p.theta_3, p.delta_c) == (0, 0.1, "two-tap", 0.0, 0.5)
    assert (p.latency, p.sigma_2, p.t_sp, p.k_0, p.warm_start) == ("jump", 0.5, 0.78, 0.0, False)
    assert [p.frame_interval_ms(fps) for fps in (30.0, 18.0, 25.0)] == [33.0, 55.0, 40.0]


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
    assert LGMDParams.from_dict(params.to_dict()) == params


def test_partial_toml_file_keeps_the_other_defaults(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("# a narrower filter\nt_sp = 1\ntau_2 = [60, 100, inf]\n")
    assert LGMDParams.from_toml(path) == LGMDParams(t_sp=1.0, tau_2=(60.0, 100.0, math.inf))


def test_unknown_key_suggests_the_closest_one(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("t_spp = 0.7\n")
    with pytest.raises(ValueError, match=r"unknown LGMD parameter 't_spp'; did you mean 't_sp'\?"):
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
        ({"t_f": 0.0}, "t_f must be > 0, got 0"),
        ({"t_sp": 1.5}, "t_sp must be >= 0 and <= 1, got 1.5"),
        ({"t_de": math.inf}, "t_de must be >= 0 and finite, got inf"),
        ({"n_p": 2.5}, "n_p must be an integer, got 2.5"),
        ({"n_ts": 0}, "n_ts must be >= 1 and <= 256, got 0"),
        ({"weights": (1.0, 2.0)}, "weights must be 3 numbers (centre, nearest, diagonal), got (1.0, 2.0)"),
        ({"delay": "none"}, "delay must be one of 'recursive', 'two-tap', got 'none'"),
        ({"on_off": 1}, "on_off must be true or false, got 1"),
        ({"u": 0.0}, "must sum to < 1, got 1 from u = 0 and n_p = 2; raise u or lower n_p"),
    ],
)
def test_error_contains_field_bound_and_value(field, message):
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        LGMDParams(**field)


@pytest.mark.parametrize("spec", [None, {"t_sp": 0.5}, LGMDParams(t_sp=0.5)])
def test_make_accepts_every_spec(spec):
    assert LGMDParams.make(spec).t_sp == (0.7 if spec is None else 0.5)


def test_docstring_describes_every_field():
    for field in dataclasses.fields(LGMDParams):
        assert re.search(rf"^    {field.name}: ", inspect.getdoc(LGMDParams) or "", re.MULTILINE), field.name
