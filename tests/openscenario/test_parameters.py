"""Parameters: declarations, constraints, and files that vary them."""

import pytest
from support.openscenario import (
    FAST,
    HEADER,
    START,
    compiled,
    element,
    lane_position,
    parameter,
    scenario,
    teleport,
    values,
    variation,
    varied,
    write,
)

from lgmd_gym.errors import InputNote
from lgmd_gym.openscenario.parameters import variations
from lgmd_gym.openscenario.reader import read, read_cells


def declared(folder, *items):
    text = "".join(items)
    return element(folder, f"<A><ParameterDeclarations>\n{text}</ParameterDeclarations></A>").scope


def test_declarations_in_order(tmp_path):
    scope = declared(tmp_path, parameter("v", "36"), parameter("w", "${$v / 3.6}"), parameter("u", "$w"))
    assert scope == {"v": "36", "w": "10", "u": "10"}


def group(*rules):
    inside = "".join(f'<ValueConstraint rule="{rule}" value="{value}"/>' for rule, value in rules)
    return f"<ConstraintGroup>{inside}</ConstraintGroup>"


@pytest.mark.parametrize(
    ("value", "constraints", "violated"),
    [
        ("5", group(("greaterThan", "4")), None),
        ("4", group(("greaterThan", "4")), "greaterThan 4"),
        ("4", group(("greaterOrEqual", "4"), ("lessOrEqual", "6")), None),
        ("7", group(("greaterOrEqual", "4"), ("lessOrEqual", "6")), "greaterOrEqual 4 and lessOrEqual 6"),
        ("1", group(("equalTo", "-1")) + group(("equalTo", "1.0")), None),
        ("0", group(("equalTo", "-1")) + group(("equalTo", "1")), "equalTo -1 or equalTo 1"),
        ("2", group(("notEqualTo", "2")), "notEqualTo 2"),
        ("3", group(("lessThan", "3")), "lessThan 3"),
    ],
)
def test_one_group_of_constraints_must_hold(tmp_path, value, constraints, violated):
    text = parameter("x", value, constraints=constraints)
    if violated is None:
        assert declared(tmp_path, text) == {"x": value}
    else:
        message = rf"part\.xml:2: parameter x must be {violated}, got '{value}'"
        with pytest.raises(ValueError, match=message):
            declared(tmp_path, text)


def test_texts_are_compared_as_texts(tmp_path):
    night = group(("equalTo", "Sunny")) + group(("equalTo", "Night"))
    assert declared(tmp_path, parameter("light", "Night", "string", night)) == {"light": "Night"}
    with pytest.raises(ValueError, match="parameter light: rule lessThan needs numbers, got 'Night' and 'x'"):
        declared(tmp_path, parameter("light", "Night", "string", group(("lessThan", "x"))))


@pytest.mark.parametrize(
    ("kind", "value", "message"),
    [
        ("double", "fast", "parameter x of type double must be a number, got 'fast'"),
        ("int", "inf", "parameter x of type int must be a whole number, got 'inf'"),
        ("unsignedShort", "nan", "parameter x of type unsignedShort must be a whole number, got 'nan'"),
        ("int", "1.5", "parameter x of type int must be a whole number, got '1.5'"),
        ("boolean", "yes", "parameter x must be true or false, got 'yes'"),
        ("real", "1", "parameterType='real' is not supported; use double"),
    ],
)
def test_types(tmp_path, kind, value, message):
    with pytest.raises(ValueError, match=message):
        declared(tmp_path, parameter("x", value, kind))


def distribution(folder, inside):
    return variations(element(folder, f"<P><Deterministic>\n{inside}\n</Deterministic></P>"))


def stepped(name, low, high, step):
    return (
        f'<DeterministicSingleParameterDistribution parameterName="{name}"><DistributionRange '
        f'stepWidth="{step}"><Range lowerLimit="{low}" upperLimit="{high}"/></DistributionRange>'
        "</DeterministicSingleParameterDistribution>"
    )


def joint(*sets):
    inside = "".join(
        "<ParameterValueSet>"
        + "".join(f'<ParameterAssignment parameterRef="{k}" value="{v}"/>' for k, v in item.items())
        + "</ParameterValueSet>"
        for item in sets
    )
    return (
        f"<DeterministicMultiParameterDistribution><ValueSetDistribution>{inside}</ValueSetDistribution>"
        "</DeterministicMultiParameterDistribution>"
    )


def test_cells_are_all_combinations(tmp_path):
    inside = values("a", "x", "y") + stepped("b", 10, 12, 1) + joint({"c": 1, "d": 2}, {"c": 3, "d": 4})
    cells = [
        {name: item.value for name, item in cell.items()} for cell in distribution(tmp_path, inside)
    ]  # fmt: skip
    assert len(cells) == 2 * 3 * 2
    assert cells[0] == {"a": "x", "b": "10", "c": "1", "d": "2"}
    assert cells[1] == {"a": "x", "b": "10", "c": "3", "d": "4"}
    assert cells[-1] == {"a": "y", "b": "12", "c": "3", "d": "4"}


@pytest.mark.parametrize(
    ("low", "high", "step", "expected"),
    [
        (0, 0.3, 0.1, ["0", "0.1", "0.2", "0.3"]),  # 0.1 * 3 is 0.30000000000000004
        (10, 19, 5, ["10", "15"]),
        (5, 5, 1, ["5"]),
    ],
)
def test_ranges_include_a_limit_that_the_steps_reach(tmp_path, low, high, step, expected):
    assert [cell["v"].value for cell in distribution(tmp_path, stepped("v", low, high, step))] == expected


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (stepped("v", 5, 1, 1), "a range needs stepWidth > 0 and upperLimit >= lowerLimit"),
        (stepped("v", 0, 1, 0), "a range needs stepWidth > 0"),
        (stepped("v", -1e308, 1e308, 1), "at most 100000 values, got inf"),
        (stepped("v", 0, 1, "1e-320"), "at most 100000 values, got inf"),
        (stepped("v", 0, 1e9, 1), "at most 100000 values, got 1e"),
        (stepped("v", 0, 999, 1) + stepped("w", 0, 999, 1), "more than 100000 cells"),
        (values("v", 1) + values("v", 2), r"part\.xml:3: parameter v is varied twice"),
        (values("v"), "the distribution of v has no value"),
        (joint(), "must contain a ParameterValueSet"),
        (joint({"a": 1}, {"b": 1}) + values("b", 1), "parameter b is varied twice"),
        ("<UserDefinedDistribution/>", "UserDefinedDistribution is not supported"),
    ],
)
def test_invalid_distributions(tmp_path, inside, message):
    with pytest.raises(ValueError, match=message):
        distribution(tmp_path, inside)


def test_violations_state_the_line_of_the_value(tmp_path):
    write(tmp_path, scenario(START, parameters=parameter("h", "5", constraints=group(("greaterThan", "4")))))
    path = tmp_path / "vary.xosc"
    path.write_text(variation(values("h", "3", "2")))
    with pytest.raises(ValueError, match=r"vary\.xosc:5: parameter h must be greaterThan 4, got '3'"):
        read_cells(path)
    path.write_text(variation(values("hh", "6")))
    with pytest.raises(ValueError, match=r"vary\.xosc:5: unknown parameter 'hh'; did you mean 'h'"):
        read_cells(path)


def test_a_stochastic_distribution_is_refused(tmp_path):
    path = tmp_path / "vary.xosc"
    path.write_text(
        f'<OpenSCENARIO>{HEADER}<ParameterValueDistribution><ScenarioFile filepath="case.xosc"/>'
        '<Stochastic numberOfTestRuns="3"/></ParameterValueDistribution></OpenSCENARIO>'
    )
    write(tmp_path, scenario(START))
    with pytest.raises(ValueError, match="must contain Deterministic, got ScenarioFile, Stochastic"):
        read_cells(path)


def test_a_deeply_nested_file_is_refused(tmp_path):
    groups = "<ConstraintGroup>" * 50_000 + "</ConstraintGroup>" * 50_000
    text = scenario(START, parameters=parameter("x", "1", constraints=groups))
    with pytest.raises(ValueError, match=r"case\.xosc:\d+: ConstraintGroup is within more than 200 elements"):
        compiled(tmp_path, text)


def test_cells_that_violate_constraints_are_left_out_with_a_note(tmp_path):
    rule = '<ConstraintGroup><ValueConstraint rule="greaterThan" value="2"/></ConstraintGroup>'
    write(tmp_path, scenario(START, parameters=parameter("x", "5", constraints=rule)))
    path = tmp_path / "vary.xosc"
    path.write_text(variation(values("x", 1, 2, 3, 4)))
    with pytest.warns(InputNote, match=r"vary\.xosc:\d+: parameter x must be .*; 2 of 4 cells left"):
        assert len(read(path).cases) == 2
    path.write_text(variation(values("x", 1, 2)))
    with pytest.raises(ValueError, match="parameter x must be greaterThan 2, got '1'"):
        read(path)


def test_paths_with_backslashes(tmp_path):
    (tmp_path / "sub").mkdir()
    write(tmp_path / "sub", scenario(START))
    text = scenario(START, road_name=r"sub\road.xodr")
    path = tmp_path / "case.xosc"
    path.write_text(text)
    assert len(read(path).cases) == 1
    path.write_text(variation("", r".\sub\case.xosc"))
    assert len(read(path).cases) == 1


def test_sets_of_different_parameters(tmp_path):
    """A parameter that a set leaves out has its value of the scenario."""
    declared = parameter("Ego_speed_kph", "36") + parameter("Place", "160")
    init = FAST + teleport("Target", lane_position("$Place"))
    sets = joint({"Ego_speed_kph": 72}, {"Place": 150}, {"Ego_speed_kph": 54, "Place": 140})
    cells = read_cells(varied(tmp_path, sets, parameters=declared, init=init))
    assert [cell.compiled.scenario.ego_speed for cell in cells] == pytest.approx([20.0, 10.0, 15.0])
    assert [cell.compiled.contact for cell in cells] == pytest.approx([56 / 20, 46 / 10, 36 / 15])
    assert [cell.variant for cell in cells] == ["v72", "v36", "v54"]
