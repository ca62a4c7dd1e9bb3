"""Expressions `${...}` of OpenSCENARIO: numbers, parameters, operators and functions of the standard.

The grammar, from weak to strong: or, and, not, + and -, * / and %, unary minus, then a number, a constant, a
parameter `$name`, a function or a group in parentheses.
"""

import math
import re
from collections.abc import Callable, Mapping

from lgmd_gym.errors import shown, unknown_name

Value = float | bool
MAX_LENGTH = 5000  # characters
MAX_DEPTH = 100  # of nested groups
_TOKEN = re.compile(
    r"\s*(\$\{?\w+\}?|\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?|[A-Za-z_]\w*|[-+*/%(),])"
)
CONSTANTS: dict[str, Value] = {"pi": math.pi, "PI": math.pi, "e": math.e, "true": True, "false": False}


def _sign(value: float) -> float:
    return float((value > 0.0) - (value < 0.0))


def _round(value: float) -> float:
    """Round half away from zero, as in the standard's reference language."""
    return math.copysign(math.floor(abs(value) + 0.5), value)


_FUNCTIONS: dict[str, tuple[int, Callable[..., float]]] = {
    "round": (1, _round),
    "floor": (1, lambda value: float(math.floor(value))),
    "ceil": (1, lambda value: float(math.ceil(value))),
    "sqrt": (1, math.sqrt),
    "pow": (2, math.pow),
    "sin": (1, math.sin),
    "cos": (1, math.cos),
    "tan": (1, math.tan),
    "asin": (1, math.asin),
    "acos": (1, math.acos),
    "atan": (1, math.atan),
    "sign": (1, _sign),
    "abs": (1, math.fabs),
    "max": (2, max),
    "min": (2, min),
}


def evaluate(text: str, parameters: Mapping[str, str]) -> Value:
    """Return the value of an expression.

    Args:
        text: The expression, without `${` and `}`.
        parameters: Values of the parameters as text.

    Raises:
        ValueError: If the expression is not valid, or its value is undefined or infinite.
    """
    if len(text) > MAX_LENGTH:
        raise ValueError(f"an expression must have at most {MAX_LENGTH} characters, got {len(text)}")
    try:
        value = _Parser(_tokens(text), parameters).parse()
    except (ZeroDivisionError, OverflowError) as error:
        raise ValueError(f"expression {shown(text)} has no value: {error}") from None
    except ValueError as error:
        raise ValueError(f"expression {shown(text)}: {error}") from None
    if not isinstance(value, bool) and not math.isfinite(value):
        raise ValueError(f"expression {shown(text)} has the value {value}")
    return value


def format_value(value: Value) -> str:
    """Return a value as text; whole numbers without a decimal point."""
    if isinstance(value, bool):
        return str(value).lower()
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))


def _tokens(text: str) -> list[str]:
    tokens, position = [], 0
    end = len(text.rstrip())
    while position < end:
        match = _TOKEN.match(text, position)
        if match is None:
            raise ValueError(f"cannot read {shown(text[position:])}")
        tokens.append(match[1])
        position = match.end()
    return tokens


class _Parser:
    """Recursive descent over the tokens of an expression."""

    def __init__(self, tokens: list[str], parameters: Mapping[str, str]) -> None:
        self._tokens, self._parameters = tokens, parameters
        self._next, self._depth = 0, 0

    def parse(self) -> Value:
        value = self._or()
        if self._next < len(self._tokens):
            raise ValueError(f"unexpected {self._peek()!r}")
        return value

    def _peek(self) -> str:
        return self._tokens[self._next] if self._next < len(self._tokens) else ""

    def _take(self, *tokens: str) -> str:
        """Return the next token and advance, if it is one of some; else an empty text."""
        token = self._peek()
        if token and token in tokens:
            self._next += 1
            return token
        return ""

    def _expect(self, token: str) -> None:
        if not self._take(token):
            raise ValueError(f"expected {token!r}, got {self._peek() or 'the end'!r}")

    def _or(self) -> Value:
        value = self._and()
        while self._take("or"):
            other = _as_bool(self._and())
            value = _as_bool(value) or other
        return value

    def _and(self) -> Value:
        value = self._not()
        while self._take("and"):
            other = _as_bool(self._not())
            value = _as_bool(value) and other
        return value

    def _not(self) -> Value:
        return not _as_bool(self._deeper(self._not)) if self._take("not") else self._sum()

    def _sum(self) -> Value:
        value = self._product()
        while operator := self._take("+", "-"):
            other = _as_number(self._product())
            value = _as_number(value) + (other if operator == "+" else -other)
        return value

    def _product(self) -> Value:
        value = self._unary()
        while operator := self._take("*", "/", "%"):
            other, number = _as_number(self._unary()), _as_number(value)
            if operator == "*":
                value = number * other
            else:
                value = number / other if operator == "/" else math.fmod(number, other)
        return value

    def _unary(self) -> Value:
        if self._take("-"):
            return -_as_number(self._deeper(self._unary))
        return _as_number(self._deeper(self._unary)) if self._take("+") else self._atom()

    def _atom(self) -> Value:
        if self._take("("):
            value = self._deeper(self._or)
            self._expect(")")
            return value
        token = self._peek()
        if not token or token in "+-*/%),":
            raise ValueError(f"expected a value, got {token or 'the end'!r}")
        self._next += 1
        if token.startswith("$"):
            return self._parameter(token.strip("${}"))
        if token[0].isdigit() or token[0] == ".":
            return float(token)
        if self._peek() == "(":
            return self._call(token)
        if token not in CONSTANTS:
            raise unknown_name("constant", token, CONSTANTS)
        return CONSTANTS[token]

    def _call(self, name: str) -> float:
        if name not in _FUNCTIONS:
            raise unknown_name("function", name, _FUNCTIONS)
        count, function = _FUNCTIONS[name]
        self._expect("(")
        values = [_as_number(self._deeper(self._or))]
        while self._take(","):
            values.append(_as_number(self._deeper(self._or)))
        self._expect(")")
        if len(values) != count:
            raise ValueError(f"{name} takes {count} values, got {len(values)}")
        try:
            return float(function(*values))
        except ValueError:
            raise ValueError(
                f"{name}({', '.join(f'{value:g}' for value in values)}) is not defined"
            ) from None

    def _parameter(self, name: str) -> Value:
        if name not in self._parameters:
            raise unknown_name("parameter", name, self._parameters)
        text = self._parameters[name]
        if text in ("true", "false"):
            return text == "true"
        try:
            return float(text)
        except ValueError:
            raise ValueError(f"parameter {name} must be a number, got {shown(text)}") from None

    def _deeper(self, rule: Callable[[], Value]) -> Value:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise ValueError(f"more than {MAX_DEPTH} nested groups")
        value = rule()
        self._depth -= 1
        return value


def _as_number(value: Value) -> float:
    if isinstance(value, bool):
        raise ValueError(f"expected a number, got {str(value).lower()}")
    return value


def _as_bool(value: Value) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"expected true or false, got {value:g}")
    return value
