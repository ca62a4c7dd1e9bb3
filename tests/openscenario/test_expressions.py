"""Expressions `${...}`, by hand."""

import math
import re

import pytest

from lgmd_gym.openscenario.nodes import evaluate, format_value

PARAMETERS = {"v": "36", "name": "CCRs", "flag": "true", "x_1": "-2.5"}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("10 - 4 - 3", 3.0),
        ("8 / 4 / 2", 1.0),
        ("7 % 4", 3.0),
        ("-7 % 4", -3.0),  # the sign of the first operand
        ("-2 * -3", 6.0),
        ("- -2", 2.0),
        ("+3 - +1", 2.0),
        ("2.5e1 + .5", 25.5),
        ("$v / 3.6", 10.0),
        ("${v} * 2", 72.0),
        ("$x_1 * $x_1", 6.25),
        ("pi", math.pi),
        ("round(2.5)", 3.0),
        ("round(-2.5)", -3.0),
        ("round(2.4)", 2.0),
        ("floor(-1.5)", -2.0),
        ("ceil(-1.5)", -1.0),
        ("sqrt(9)", 3.0),
        ("pow(2, 10)", 1024.0),
        ("sin(pi / 2) + cos(0) + tan(0)", 2.0),
        ("asin(1) + acos(1) + atan(0)", math.pi / 2),
        ("sign(-3) + sign(0) + sign(5)", 0.0),
        ("abs(-4)", 4.0),
        ("max(1, 2) + min(1, 2)", 3.0),
        ("not false and true", True),
        ("false or $flag", True),
        ("not (true or false)", False),
        ("true and not true or true", True),
    ],
)
def test_values(text, value):
    assert evaluate(text, PARAMETERS) == pytest.approx(value, abs=1e-15)
    assert isinstance(evaluate(text, PARAMETERS), bool) is isinstance(value, bool)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1 +", "expected a value, got 'the end'"),
        ("1 2", "unexpected '2'"),
        ("(1", "expected ')', got 'the end'"),
        ("1 / 0", "has no value: float division by zero"),
        ("$w", "unknown parameter 'w'"),
        ("$name * 2", "parameter name must be a number, got 'CCRs'"),
        ("sqr(2)", "unknown function 'sqr'; did you mean 'sqrt'?"),
        ("pow(2)", "pow takes 2 values, got 1"),
        ("sqrt(-1)", "sqrt(-1) is not defined"),
        ("pie", "unknown constant 'pie'; did you mean 'pi'"),
        ("true + 1", "expected a number, got true"),
        ("1 and true", "expected true or false, got 1"),
        ("__import__('os')", "cannot read"),
        ("1 ; 2", "cannot read"),
        ("1e308 * 10", "has the value inf"),
        ("(" * 200 + "1" + ")" * 200, "more than 100 nested groups"),
        ("1+" * 3000 + "1", "at most 5000 characters, got 6001"),
    ],
)
def test_errors(text, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        evaluate(text, PARAMETERS)


@pytest.mark.parametrize(
    ("value", "text"), [(2.0, "2"), (-0.5, "-0.5"), (True, "true"), (False, "false"), (0.1, "0.1")]
)
def test_values_as_text(value, text):
    assert format_value(value) == text
