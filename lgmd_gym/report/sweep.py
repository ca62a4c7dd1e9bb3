"""Sweeps in a report: the scenario's picture, and a grid over two swept arguments for each agent."""

import re

from lgmd_gym.benchmark.case import Case, Row, Suite, file_name, relative_impact
from lgmd_gym.benchmark.case_table import argument_text
from lgmd_gym.envs.dynamics.units import KMH
from lgmd_gym.envs.motion import record_motion
from lgmd_gym.envs.registration import RANDOM
from lgmd_gym.plotting.figures import scenario_figure
from lgmd_gym.report.figures import CaseGrid, GridCell
from lgmd_gym.report.sections import ReportData, save_figure

BANDS = ("red", "brown", "orange", "yellow", "green")
MAX_VALUES = 4  # of an argument that a sentence lists; of more, the best and the worst
MAX_PICTURES = 3  # families whose first scenario is drawn
_BOUNDS = re.compile(r",? in [\[(]|\s*\[|;")
_PART = re.compile(r"(.*?)(-?\d[\d.e-]*)([a-z]\w*)?")


def band(share: float | None) -> str:
    """Return the colour of a share, one per fifth and green for the highest; "" for None."""
    return "" if share is None else BANDS[min(int(5 * share), 4)]


def scenario_pictures(data: ReportData) -> list[tuple[str, str]]:
    """Return the first case of each family of an own suite, and its picture as a data URI."""
    if not data.config.own_suite:
        return []
    first: dict[str, Case] = {}
    for case in data.suite.cases:
        if case.environment != RANDOM:
            first.setdefault(case.family, case)
    return [(case.name, _picture(data, case)) for case in [*first.values()][:MAX_PICTURES]]


def _picture(data: ReportData, case: Case) -> str:
    motion, file = record_motion(case.scenario), data.figures / f"scenario-{file_name(case.family)}.svg"
    return save_figure(file, lambda out: scenario_figure(out, case.name, motion))


def sweep_grids(rows: list[Row], agent: str, cases: dict[str, Case]) -> list[CaseGrid]:
    """Return one grid per family with a sweep: the first two arguments that vary, over all other ones."""
    families: dict[str, list[Row]] = {}
    for row in rows:
        if row["agent"] == agent and row["error"] is None and cases[row["case"]].swept:
            families.setdefault(row["family"], []).append(row)
    return [
        grid for family, part in families.items() if (grid := _grid(family, agent, part, cases)) is not None
    ]


def _grid(family: str, agent: str, rows: list[Row], cases: dict[str, Case]) -> CaseGrid | None:
    """Return the grid of one family; None if no argument has several values."""
    values: dict[str, list[str]] = {}
    for case in cases.values():
        for name, part in case.swept if case.family == family else ():
            if part not in values.setdefault(name, []):
                values[name].append(part)
    varied = [name for name, parts in values.items() if len(parts) > 1][:2]
    if not varied:
        return None
    down, across = varied if len(varied) == 2 else ("", varied[0])
    cells: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        swept = dict(cases[row["case"]].swept)
        cells.setdefault((swept.get(down, ""), swept.get(across, "")), []).append(row)
    lines = [
        (_value(head), [_cell(cells.get((head, column))) for column in values[across]])
        for head in values.get(down, [""])
    ]
    axis = _axis(across, values[across][0])
    axis += f" →   {_axis(down, values[down][0])} ↓" if down else ""
    columns = [_value(part) for part in values[across]]
    return CaseGrid(f"{family}: {agent}", axis, columns, lines, agent, family)


def swept_arguments(suite: Suite) -> list[tuple[str, str]]:
    """Return each swept argument and its meaning in the docstring of its family, without bounds and unit.

    A family that is not loaded, as one of a user in a report that is written later, has no meanings.
    """
    found: dict[str, str] = {}
    for case in suite.cases:
        for name, _ in case.swept:
            if name not in found:
                found[name] = _BOUNDS.split(argument_text(case.family, name))[0].strip().rstrip(".")
    return [(name, text) for name, text in found.items() if text]


def sweep_sentences(rows: list[Row], agent: str, cases: dict[str, Case]) -> list[str]:
    """Return with which swept argument the outcome of an agent varies most, one sentence per family.

    An outcome is good if a threat is avoided, or an episode without a threat has no false activation. A
    family whose shares are equal at all values has no sentence.
    """
    played: dict[str, list[bool]] = {}
    for row in rows:
        if row["agent"] == agent and row["error"] is None:
            played.setdefault(row["case"], []).append(_is_good(row))
    families: dict[str, dict[str, dict[str, list[bool]]]] = {}
    for case in cases.values():  # in the order of the suite
        for name, part in case.swept if case.name in played else ():
            parts = families.setdefault(case.family, {}).setdefault(name, {})
            parts.setdefault(part, []).extend(played[case.name])
    sentences: list[str] = []
    for family, arguments in families.items():
        name = max(arguments, key=lambda name: _spread(arguments[name]))
        parts = arguments[name]
        if _spread(parts) > 0.0:
            shown = [*parts]
            if len(shown) > MAX_VALUES:
                shown.sort(key=lambda part: -_share(parts[part]))
                shown = [shown[0], shown[-1]]
            texts = [f"{sum(parts[part])} of {len(parts[part])} at {_quantity(name, part)}" for part in shown]
            sentences.append(f"In {family}, {agent} varies most with {name}: good in {', '.join(texts)}.")
    return sentences


def _share(good: list[bool]) -> float:
    return sum(good) / len(good)


def _spread(parts: dict[str, list[bool]]) -> float:
    shares = [*map(_share, parts.values())]
    return max(shares) - min(shares)


def _is_good(row: Row) -> bool:
    """Return whether a threat is avoided, or a non-threat has no false activation."""
    return bool(row["avoided"]) if row["threat"] else not row["false_activation"]


def _cell(rows: list[Row] | None) -> GridCell | None:
    """Return the share of threats avoided and of non-threats without a false activation."""
    if not rows:
        return None
    good = sum(map(_is_good, rows))
    contacts = sum(bool(row["collision"]) for row in rows)
    premature = sum(bool(row["premature_brake"]) for row in rows)
    impact = max(map(relative_impact, rows)) / KMH
    threats = sum(bool(row["threat"]) for row in rows)
    tooltip = (
        f"{good} of {len(rows)} good; {threats} threats, contact in {contacts}, premature braking in "
        f"{premature}, highest impact {impact:.0f} km/h"
    )
    text = f"{good}/{len(rows)}"
    return GridCell(band(good / len(rows)), text, tooltip, impact, contacts, premature, len(rows), False)


def _value(part: str) -> str:
    """Return the value in a part of a case's name: "8" of "gap8m"; the part itself for a flag or word."""
    match = _PART.fullmatch(part)
    return match[2] if match else part


def _axis(name: str, part: str) -> str:
    """Return the name of an argument with its unit in the names of cases."""
    unit = _unit(name, part)
    return f"{name} [{unit}]" if unit else name


def _quantity(name: str, part: str) -> str:
    """Return the value in a part of a case's name with its unit: "8 m" of "gap8m"."""
    unit = _unit(name, part)
    return f"{_value(part)} {unit}" if unit else _value(part)


def _unit(name: str, part: str) -> str:
    match = _PART.fullmatch(part)
    unit = "km/h" if name == "ego_speed" else {"kmh": "km/h", "mps2": "m/s²"}.get(str(match and match[3]), "")
    return unit or (match[3] or "" if match else "")
