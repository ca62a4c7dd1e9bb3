"""Tables of an environment's observation, info and arguments, read from the code."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from docstring_markdown import argument_texts, fields_table, markdown_rows, rst_rows, sections, table
from gymnasium import spaces

from lgmd_gym.envs.appearance import Appearance
from lgmd_gym.envs.attention import Attention
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.dynamics.brake import BrakeParams
from lgmd_gym.envs.dynamics.script import Bend, Segment
from lgmd_gym.envs.families.scenario import Actor, RoadPlan, Scenario
from lgmd_gym.envs.registration import APPEARANCE, RANDOM_TASKS, SCENARIO, make_braking, make_traffic
from lgmd_gym.envs.reward import RewardParams
from lgmd_gym.fields import Record
from lgmd_gym.report.gallery.cards import DocumentedArgument, ScenarioCard, parse_docstring
from lgmd_gym.wrappers.observation import LGMDObservation

_REFERENCES = {cls.__name__: cls for cls in (LGMDObservation, Appearance)}


def observation_table(space: spaces.Dict) -> str:
    """Return the entries of an observation space with their shapes and ranges as a Markdown table."""
    meanings = {row[0].strip("`"): row[2] for row in rst_rows(LGMDObservation) if len(row) == 3}
    rows = []
    for key, item in space.items():
        assert isinstance(item, spaces.Box)
        limits = f"{_limit(item.low)} to {_limit(item.high)}"
        rows.append((f"`{key}`", f"`{item.shape}`", f"`{item.dtype}`", limits, meanings[key]))
    return table(("key", "shape", "type", "range", "meaning"), rows)


def _limit(values: np.ndarray) -> str:
    """Return a bound: one number if it is the same for all elements, else the list."""
    shown = [f"{value:.6g}".replace("-", "−") for value in np.unique(values)]
    if len(shown) > 1:
        shown = [f"{value:.6g}".replace("-", "−") for value in values.ravel()]
    return shown[0] if len(shown) == 1 else f"[{', '.join(shown)}]"


def info_table(info: Mapping[str, Any], cls: Any) -> str:
    """Return the keys of an info with their meanings, which must be documented, as a Markdown table."""
    meanings: dict[str, list[str]] = {}
    for base in (BrakingEnv, cls):
        for keys, *rest in markdown_rows(sections(base)["Info"]):
            meanings |= {key: [*rest, ""][:2] for key in re.findall(r"`(\w+)`", keys)}
    meanings |= {row[0].strip("`"): [row[1], ""] for row in rst_rows(LGMDObservation) if "lgmd/" in row[0]}
    rows = []
    for key, value in info.items():
        general = re.sub(r"^lgmd/\w+/", "lgmd/<channel>/", key)
        rows.append((f"`{key}`", f"`{type(value).__name__}`", *meanings[general]))
    return table(("key", "type", "meaning", "undefined"), rows)


def argument_tables(card: ScenarioCard, cls: Any) -> str:
    """Return the arguments of an environment and the fields that some of them have as Markdown tables."""
    config = argument_texts(cls)["config"]
    rows = [
        (f"`{row.name}`", f"`{row.default}`" if row.default else "–", _meaning(row, config))
        for row in _arguments(card)
    ]
    parts = [table(("argument", "default", "meaning"), rows)]
    if card.name == SCENARIO:
        for item in (Scenario, Actor, RoadPlan, Segment, Bend):
            parts += [f"### {item.__name__}", fields_table(item)]
    parts += ["### Brake, in `config`", fields_table(BrakeParams)]
    if card.traffic:
        parts += ["### Drivers who err, in `attention`", fields_table(Attention)]
    else:
        parts += ['### Reward, in `config["reward"]`', fields_table(RewardParams)]
    return "\n\n".join(parts)


def _arguments(card: ScenarioCard) -> list[DocumentedArgument]:
    """Return the arguments of an environment: its own, then those of all environments."""
    own = list(card.docstring.arguments)
    if card.name == SCENARIO:
        text = "A `Scenario`, or a dict of its fields, with the types of the tables below."
        own = [DocumentedArgument("scenario", "", text)]
    common = list(parse_docstring(make_traffic if card.traffic else make_braking).arguments[1:])
    if not card.traffic and card.name not in RANDOM_TASKS:
        for name in reversed(APPEARANCE):
            if name not in {item.name for item in own}:
                value = getattr(Appearance(), name)
                shown = f"{type(value).__name__}()" if isinstance(value, Record) else repr(value)
                common.insert(0, DocumentedArgument(name, shown, "See `Appearance`."))
    return own + common


def _meaning(argument: DocumentedArgument, config: str) -> str:
    """Return the description of an argument without its default, which has a column."""
    return re.sub(r"; default [^;]*\.$", ".", _resolved(argument, config))


def _resolved(argument: DocumentedArgument, config: str) -> str:
    """Return the description of an argument, with a reference to another docstring replaced by its text."""
    if argument.name == "config":
        return config
    match = re.match(r"See `(?:[\w.]+\.)?(\w+)`(.*)", argument.text)
    if not match or match[1] not in _REFERENCES:
        return argument.text
    addition = match[2].strip("; .")
    text = argument_texts(_REFERENCES[match[1]])[argument.name]
    return f"{text} {addition[0].upper()}{addition[1:]}." if addition else text
