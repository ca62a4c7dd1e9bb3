import dataclasses
import math
import re

import pytest

from lgmd_gym.neuron import LGMDParams

PRESETS = {
    "default": LGMDParams(),
    "released": LGMDParams.released(),
    "fixed_inhibition": LGMDParams.fixed_inhibition(),
    "off_only": LGMDParams.off_only(),
    "yue_rind2006": LGMDParams.yue_rind2006(),
}


def test_the_defaults_are_the_papers():
    p = LGMDParams()
    assert (p.n_p, p.u, p.tau_1, p.tau_2, p.weights) == (
        2,
        1.0,
        10.0,
        (60.0, 120.0, 180.0),
        (1.0, 0.25, 0.125),
    )
    assert (p.theta_1, p.theta_2, p.theta_3, p.c_w, p.delta_c, p.c_de, p.t_de) == (1, 1, 1, 4, 0.01, 0.5, 15)
    assert (p.t_f, p.sigma_1, p.sigma_2, p.tau_g, p.sigma_3) == (20, 0.5, 0.01, 10, 1)
    assert (p.tau_s, p.t_sfa, p.sigma_4, p.t_sp, p.n_ts, p.t_sf) == (500, 0.003, 10, 0.7, 6, 30)


def test_the_released_code_differs_where_the_page_says():
    p = LGMDParams.released()
    assert (p.n_p, p.on_off_residue, p.delay, p.theta_3, p.delta_c) == (0, 0.1, "two-tap", 0.0, 0.5)
    assert (p.latency, p.sigma_2, p.t_sp, p.k_0, p.warm_start) == ("jump", 0.5, 0.78, 0.0, False)
    assert [p.frame_interval_ms(fps) for fps in (30.0, 18.0, 25.0)] == [33.0, 55.0, 40.0]


def test_the_persistence_is_equation_1():
    assert LGMDParams(n_p=3).persistence == pytest.approx([0.268941, 0.119203, 0.047426], abs=1e-6)
    assert LGMDParams(n_p=0).persistence == ()


@pytest.mark.parametrize("name", PRESETS)
def test_toml_and_dict_round_trips(name, tmp_path):
    params = PRESETS[name]
    params.to_toml(tmp_path / "p.toml")
    assert LGMDParams.from_toml(tmp_path / "p.toml") == params
    assert LGMDParams.from_dict(params.to_dict()) == params


def test_a_toml_file_may_be_partial_and_written_by_hand(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("# a narrower filter\nt_sp = 1\ntau_2 = [60, 100, inf]\n")
    assert LGMDParams.from_toml(path) == LGMDParams(t_sp=1.0, tau_2=(60.0, 100.0, math.inf))


def test_an_unknown_key_names_the_nearest(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("t_spp = 0.7\n")
    with pytest.raises(ValueError, match=r"unknown LGMD parameter 't_spp'; did you mean 't_sp'\?"):
        LGMDParams.from_toml(path)


def test_a_file_that_is_no_toml_is_named(tmp_path):
    path = tmp_path / "p.toml"
    path.write_text("t_sp: 0.7\n")
    with pytest.raises(ValueError, match=r"p\.toml is not TOML"):
        LGMDParams.from_toml(path)


def test_equal_parameters_are_one_key_and_cannot_change():
    assert {LGMDParams(t_sp=0.5): 1}[LGMDParams(t_sp=0.5)] == 1
    assert LGMDParams(tau_2=[60, 120, 180]) == LGMDParams()  # pyright: ignore[reportArgumentType]
    assert len(set(PRESETS.values())) == len(PRESETS)
    with pytest.raises(dataclasses.FrozenInstanceError):
        LGMDParams().t_sp = 0.5  # pyright: ignore[reportAttributeAccessIssue]


NUMBERS = [f.name for f in dataclasses.fields(LGMDParams) if not isinstance(f.default, bool | str)]


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [-1.0, math.nan, "0.5", None, True])
def test_every_number_is_checked(name, value):
    default = getattr(LGMDParams(), name)
    bad = (value,) * 3 if isinstance(default, tuple) else value
    with pytest.raises((ValueError, TypeError), match=name):
        LGMDParams(**{name: bad})


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ({"t_f": 0.0}, "t_f = 0 must be > 0"),
        ({"t_sp": 1.5}, "t_sp = 1.5 must be >= 0 and <= 1"),
        ({"t_de": math.inf}, "t_de = inf must be >= 0 and finite"),
        ({"n_p": 2.5}, "n_p = 2.5 must be a whole number, not float"),
        ({"n_ts": 0}, "n_ts = 0 must be >= 1 and <= 256"),
        ({"weights": (1.0, 2.0)}, "weights = (1.0, 2.0) must be 3 numbers: centre, nearest, diagonal"),
        ({"delay": "none"}, "delay = 'none' must be one of 'recursive', 'two-tap'"),
        ({"on_off": 1}, "on_off = 1 must be True or False, not int"),
        ({"u": 0.0}, "the persistence coefficients sum to 1, which must be < 1"),
    ],
)
def test_a_refusal_names_field_value_and_bound(field, message):
    with pytest.raises((ValueError, TypeError), match=re.escape(message)):
        LGMDParams(**field)


def test_the_docstring_describes_every_field():
    for field in dataclasses.fields(LGMDParams):
        assert re.search(rf"^        {field.name}: ", LGMDParams.__doc__ or "", re.MULTILINE), field.name
