"""Mutants of a Python source: the source with one small change, at the positions of its syntax tree."""

import ast
import re
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

SWAPS = {
    ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"),
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"), ast.Mod: ("%", "*"), ast.Pow: ("**", "*"),
    ast.And: ("and", "or"), ast.Or: ("or", "and"),
}  # fmt: skip
CALLS = {"min": "max", "max": "min", "sin": "cos", "cos": "sin", "floor": "ceil", "ceil": "floor"}
# The contents of these have no effect on results.
IGNORED = (ast.Raise, ast.JoinedStr, ast.Import, ast.ImportFrom)


class Mutant(NamedTuple):
    """One changed source: line of the change, the line before and after it, and the source."""

    line: int
    before: str
    after: str
    source: bytes


def mutants_of(source: bytes, skipped: tuple[str, ...] = ()) -> Iterator[Mutant]:
    """Return all mutants of a source, except those in the functions named `skipped`."""
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for first, end, text in _changes(ast.parse(source), source, starts, skipped):
        changed = source[:first] + text.encode() + source[end:]
        number = source.count(b"\n", 0, first)
        lines = (item.split(b"\n")[number].decode().strip() for item in (source, changed))
        yield Mutant(number + 1, *lines, changed)


Change = tuple[int, int, str]


def _changes(tree: ast.AST, source: bytes, starts: list[int], skipped: tuple[str, ...]) -> Iterator[Change]:
    """Return the changes of all nodes as (first byte, last byte + 1, new text)."""

    def span(node: ast.AST) -> tuple[int, int]:
        first, last = starts[node.lineno - 1], starts[node.end_lineno - 1]  # type: ignore[attr-defined]
        return first + node.col_offset, last + node.end_col_offset  # type: ignore[attr-defined]

    def visit(node: ast.AST, inside: bool) -> Iterator[Change]:
        if isinstance(node, IGNORED) or getattr(node, "name", "") in skipped:
            return
        inside = inside or isinstance(node, ast.FunctionDef)
        yield from _changes_of(node, source, span, inside)
        for name, value in ast.iter_fields(node):
            if name in ("annotation", "returns", "decorator_list"):
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from visit(child, inside)

    return visit(tree, False)


def _changes_of(node: ast.AST, source: bytes, span, inside: bool) -> Iterator[Change]:
    if isinstance(node, ast.Constant):
        yield from ((*span(node), text) for text in _constants(node.value))
    elif isinstance(node, ast.Compare | ast.BinOp | ast.BoolOp):
        for left, op, right in _operations(node):
            yield from _swap(op, span(left)[1], span(right)[0], source)
    elif isinstance(node, ast.UnaryOp):
        first = span(node)[0]
        yield first, first + (3 if isinstance(node.op, ast.Not) else 1), ""
    elif isinstance(node, ast.Call):
        yield from _calls(node, source, span)
    elif isinstance(node, ast.Return):
        if node.value and not isinstance(node.value, ast.Constant | ast.Tuple):
            yield *span(node.value), "0.0"
    elif inside and _is_deletable(node):
        yield *span(node), "pass"


def _operations(node: ast.Compare | ast.BinOp | ast.BoolOp) -> Iterator[tuple[ast.AST, ast.AST, ast.AST]]:
    """Return each operator of an expression with its operands: (left, operator, right)."""
    if isinstance(node, ast.BinOp):
        yield node.left, node.op, node.right
    elif isinstance(node, ast.BoolOp):
        yield from ((left, node.op, right) for left, right in pairwise(node.values))
    else:
        operands = pairwise([node.left, *node.comparators])
        yield from ((left, op, right) for (left, right), op in zip(operands, node.ops, strict=True))


def _is_deletable(node: ast.AST) -> bool:
    is_call = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    return is_call or isinstance(node, ast.Assign | ast.AugAssign | ast.Continue | ast.Break)


def _constants(value: object) -> list[str]:
    if isinstance(value, bool):
        return [str(not value)]
    if isinstance(value, int):
        return [str(value + 1)]
    if isinstance(value, float):
        return [repr(value * 1.1) if value else "0.1"]
    return []


def _swap(op: ast.AST, first: int, end: int, source: bytes) -> Iterator[Change]:
    old, new = SWAPS.get(type(op), ("", ""))
    found = old and re.search(rb"\s(" + re.escape(old.encode()) + rb")\s|\*\*", source[first:end])
    if found:
        group = 1 if found.group(1) else 0
        yield first + found.start(group), first + found.end(group), new


def _calls(node: ast.Call, source: bytes, span) -> Iterator[Change]:
    first, end = span(node.func)
    name = source[first:end].decode().removeprefix("math.")
    if name in CALLS:
        yield end - len(name), end, CALLS[name]
    if name == "abs":
        yield first, end, ""
