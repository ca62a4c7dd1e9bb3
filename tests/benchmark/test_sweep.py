"""Sweeps of suite files: their values, products and names, worked out by hand."""

import json

import pytest
import tomli_w

from lgmd_gym.benchmark.suites import copy_suite, load_suite


@pytest.fixture
def load(tmp_path):
    """Return the function that loads a suite "mine" with one table."""

    def load(*tables, suffix=".toml"):
        values = {"name": "mine", "cases": list(tables)}
        path = tmp_path / f"mine{suffix}"
        path.write_text(json.dumps(values) if suffix == ".json" else tomli_w.dumps(values))
        return load_suite(path)

    return load


def names(suite):
    return [case.name.removeprefix("mine/") for case in suite.cases]


def arguments(suite):
    return [dict(case.arguments) for case in suite.cases]


@pytest.mark.parametrize("suffix", [".toml", ".json"])
def test_product_of_lists_and_ranges(load, suffix):
    sweep = {"gap": [6, 8], "ego_speed": {"start": 10.0, "stop": 15.0, "step": 2.5}}
    suite = load(
        {"family": "CutIn", "name": "dark", "sweep": sweep, "arguments": {"shade": 40}}, suffix=suffix
    )
    # The speed comes first: 10, 12.5 and 15 m/s are 36, 45 and 54 km/h.
    assert names(suite) == [
        "CutIn/v36/gap6m/dark", "CutIn/v36/gap8m/dark", "CutIn/v45/gap6m/dark", "CutIn/v45/gap8m/dark",
        "CutIn/v54/gap6m/dark", "CutIn/v54/gap8m/dark",
    ]  # fmt: skip
    assert arguments(suite)[3] == {"shade": 40, "ego_speed": 12.5, "gap": 8}
    assert suite.cases[3].scenario.ego_speed == 12.5


def test_speeds_in_kmh_times_a_sweep(load):
    suite = load({"family": "CutIn", "speeds_kmh": [50, 70], "sweep": {"excess": [-5.56, -2.78]}})
    # -20.016 and -10.008 km/h
    assert names(suite) == [f"CutIn/v{speed}/excess{kmh}kmh" for speed in (50, 70) for kmh in (-20, -10)]
    assert arguments(suite)[1] == {"ego_speed": 13.888889, "excess": -2.78}
    suite = load({"family": "CCRs", "speeds_kmh": {"start": 10, "stop": 40, "step": 10}})
    assert names(suite) == ["CCRs/v10", "CCRs/v20", "CCRs/v30", "CCRs/v40"]


@pytest.mark.parametrize(
    ("name", "given", "values", "parts"),
    [
        ("headway", {"start": 0.7, "stop": 0.9, "step": 0.1}, [0.7, 0.8, 0.9], ["0.7s", "0.8s", "0.9s"]),
        ("headway", {"start": 1, "stop": 2.9, "step": 1}, [1, 2], ["1s", "2s"]),
        ("headway", {"start": 2, "stop": 1, "step": -1}, [2, 1], ["2s", "1s"]),
        ("headway", {"start": 2, "stop": 2, "step": 1}, [2], ["2s"]),
        # The quotients of these ranges are just below a whole number.
        (
            "build_up",
            {"start": 0, "stop": 0.3, "step": 0.1},
            [0, 0.1, 0.2, 0.3],
            ["0s", "0.1s", "0.2s", "0.3s"],
        ),
        (
            "build_up",
            {"start": 0.3, "stop": 0, "step": -0.1},
            [0.3, 0.2, 0.1, 0],
            ["0.3s", "0.2s", "0.1s", "0s"],
        ),
        ("build_up", {"start": 0.1, "stop": 0.39, "step": 0.1}, [0.1, 0.2, 0.3], ["0.1s", "0.2s", "0.3s"]),
        # As many digits as distinguish the values, at least three.
        ("headway", [1.0, 1.00004], [1.0, 1.00004], ["1s", "1.00004s"]),
        ("headway", [1.23456, 2.0], [1.23456, 2.0], ["1.23s", "2s"]),
        ("deceleration", [4, 6], [4, 6], ["4mps2", "6mps2"]),
        ("overlap", [-0.5, 1], [-0.5, 1], ["-0.5", "1"]),
        ("lateral_offset", [0.5], [0.5], ["0.5m"]),
    ],
)
def test_values_and_parts_of_numbers(load, name, given, values, parts):
    suite = load({"family": "CCRb", "sweep": {name: given}})
    assert [item[name] for item in arguments(suite)] == values
    assert names(suite) == [f"CCRb/{name.replace('_', '-')}{part}" for part in parts]


def test_large_values_are_written_out(load):
    suite = load({"family": "CCRs", "sweep": {"world": [1234, 5]}})
    assert names(suite) == ["CCRs/world1234", "CCRs/world5"]


def test_flags_and_words(load):
    suite = load({"family": "CCCscp", "sweep": {"side": ["left", "right"], "obstructed": [True, False]}})
    assert names(suite) == [
        "CCCscp/side-left/obstructed", "CCCscp/side-left/not-obstructed",
        "CCCscp/side-right/obstructed", "CCCscp/side-right/not-obstructed",
    ]  # fmt: skip
    assert arguments(suite)[1] == {"side": "left", "obstructed": False}
    suite = load({"family": "EmptyRoad", "sweep": {"weather": ["clear", "night"]}})
    assert names(suite) == ["EmptyRoad/weather-clear", "EmptyRoad/weather-night"]
    assert [case.scenario.family for case in suite.cases] == ["EmptyRoad"] * 2


def test_copy_of_a_sweep_is_equal(load, tmp_path):
    suite = load({"family": "CutIn", "sweep": {"gap": [6, 8], "excess": [-5.56, -2.78]}, "fcw_driver": True})
    copy_suite(tmp_path / "mine.toml", tmp_path / "copy.toml")
    assert load_suite(tmp_path / "copy.toml") == suite


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"sweep": {}}, "sweep is empty; write for example"),
        ({"sweep": {"gap": []}}, "sweep.gap is empty; write at least one value"),
        ({"sweep": {"gap": [6, 6.0]}}, "sweep.gap contains 6.0 twice"),
        ({"sweep": {"gap": 6}}, "sweep.gap must be a list, or a table with start, stop and step, got 6"),
        ({"sweep": {"gap": [[6]]}}, "sweep.gap must contain numbers, strings or true and false"),
        ({"sweep": {"gap": {"start": 1, "stop": 2}}}, "sweep.gap must have the key 'step'"),
        ({"sweep": {"gap": {"start": 1, "end": 2, "step": 1}}}, "unknown key of sweep.gap 'end'"),
        (
            {"sweep": {"gap": {"start": 3, "stop": 2, "step": 1}}},
            "sweep.gap is empty: steps of 1 lead from 3 away",
        ),
        ({"sweep": {"gap": {"start": 3, "stop": 4, "step": 0}}}, "sweep.gap.step must not be 0"),
        ({"sweep": {"gap": {"start": "a", "stop": 4, "step": 1}}}, "sweep.gap.start must be a number"),
        ({"sweep": {"gap": {"start": 0, "stop": 10000, "step": 1}}}, "more than 10000 values"),
        (
            {"sweep": {name: {"start": 2.0, "stop": 20.0, "step": 0.1} for name in ("gap", "ego_speed")}},
            "at most 10000 cases, got 181 ego_speed × 181 gap = 32761",
        ),
        ({"sweep": {"gapp": [6]}}, "unknown argument of CutIn 'gapp'; did you mean 'gap'?"),
        ({"sweep": {"ego_speed": [10, 70]}}, "'mine/CutIn/v252': ego_speed: 70 m/s = 252 km/h"),
        ({"sweep": {"gap": [6]}, "arguments": {"gap": 6}}, "arguments.gap and sweep.gap exclude each other"),
        ({"sweep": {"ego_speed": [6]}, "speeds_kmh": [30]}, "speeds_kmh and sweep.ego_speed exclude"),
        ({"sweep": {"weather": ["nigth"]}}, "did you mean 'night'?"),
        ({"gap": [6]}, "write arguments = { gap = ... }, or sweep = { gap = [...] }"),
        ({"family": "Own", "sweep": {"gap": [6]}}, "a family of your own requires module = "),
        ({"family": ["CutIn"]}, "family must consist of letters, digits"),
        (
            {"family": "Cut/In", "sweep": {"gap": [6]}},
            "family must not contain '/', the separ",
        ),
        ({"name": 3}, "name must consist of letters, digits"),
        ({}, "name is missing; add name = "),
        ({"swep": {"gap": [6]}}, "unknown key of a case 'swep'; did you mean 'sweep'?"),
        ({"sweep": {"gap": [6]}, "scenario": {}}, "sweep and scenario exclude each other"),
    ],
)
def test_invalid_sweep_is_refused(load, table, message):
    with pytest.raises(ValueError) as caught:
        load({"family": "CutIn"} | table)
    assert message in str(caught.value)


def test_names_of_suites_do_not_contain_the_separator(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "my/suite"\n[[cases]]\nfamily = "CCRs"\nname = "a"\n')
    with pytest.raises(ValueError, match=r"suite must not contain '/', .* got 'my/suite'"):
        load_suite(path)


def test_equal_names_of_two_tables_are_refused(load):
    table = {"family": "CutIn", "sweep": {"gap": [6, 8]}}
    with pytest.raises(ValueError, match="case 'mine/CutIn/gap6m' is defined twice; rename one of them"):
        load(table, table)


def test_invalid_json_is_refused(tmp_path):
    path = tmp_path / "mine.json"
    for text, message in (
        ("{", "is not JSON"),
        ('{"name": "a", "name": "b"}', "key 'name' is stated twice"),
        ("[]", "must contain an object"),
    ):
        path.write_text(text)
        with pytest.raises(ValueError, match=message):
            load_suite(path)
