"""Conclusion of a run in plain English, and one sentence on each agent."""

import inspect
import re
from collections import Counter
from typing import cast

from lgmd_gym.agents.policies.card import policy_card, read_card
from lgmd_gym.agents.policies.policy import Policy, find_policy
from lgmd_gym.agents.registry import AGENTS, make_agent
from lgmd_gym.aliases import Values
from lgmd_gym.benchmark.analysis.tables import limit_results, verdict_text
from lgmd_gym.benchmark.case import Row, Suite
from lgmd_gym.benchmark.summary import (
    INTERVAL_TEXT,
    WORLDS,
    AgentSummary,
    Sample,
    by_condition,
    summarise,
    without_fcw_driver,
)
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.errors import counted
from lgmd_gym.report.sweep import sweep_sentences
from lgmd_gym.statistics.intervals import Rate

CAVEAT = (
    "These are results of one simulation with the cases of this suite. They are not a rating and do not show "
    "how a real car would perform."
)
PLACES = {LABORATORY: "In the laboratory:", WORLDS: "In worlds:"}
"""Headings of the parts of `by_condition` that are no weather."""


def conclusion(rows: list[Row], agents: list[str], suite: Suite) -> tuple[str, str, str]:
    """Return three points: the sample, the scores of each agent, and the limits with what they do not show.

    Agents are in the order of their avoided threats. Rows with an FCW driver count for the limits only.
    """
    conditions = by_condition(rows)
    braking = [agent for agent in agents if agent != NO_BRAKE]
    scores, limits = list[str](), list[str]()
    for condition, part in conditions.items():
        for sentences, found in (
            (scores, _agent_sentences(part, braking) + _sweep_sentences(part, braking, suite)),
            (limits, _limit_sentences(part, braking, suite)),
        ):
            heading = PLACES.get(condition) or f"Condition {condition}:"
            sentences += ([heading] if len(conditions) > 1 and found else []) + found
    sample, failed = [_sample_sentence(rows, suite)], sum(row["error"] is not None for row in rows)
    if failed:
        sample.append(f"{counted(failed, 'episode')} failed and {'is' if failed == 1 else 'are'} left out.")
    return " ".join(sample), " ".join(scores), " ".join([*limits, CAVEAT])


def _sample_sentence(rows: list[Row], suite: Suite) -> str:
    """Return the sizes of the run, and in how many episodes `no-brake` has contact."""
    complete = [row for row in without_fcw_driver(rows) if row["error"] is None]
    base = [row for row in complete if row["agent"] == NO_BRAKE]
    threats = sum(bool(row["threat"]) for row in base)
    start = f"The run contains {counted(len(rows), 'episode')} of suite {suite.name} ({Sample.of(rows)})."
    contacts = f" Without braking, {threats} of {counted(len(base), 'episode')} end in contact (threats)."
    return f"{start}{contacts if base else ''} Brackets contain the {INTERVAL_TEXT}."


def _agent_sentences(rows: list[Row], agents: list[str]) -> list[str]:
    """Return the avoided threats and the false activations of each agent."""
    complete = [row for row in without_fcw_driver(rows) if row["error"] is None]
    kinds = {bool(row["threat"]) for row in complete}
    avoided = Counter(row["agent"] for row in complete if row["avoided"])
    ordered = sorted(agents, key=lambda agent: -avoided[agent])
    sentences = [_agent_sentence(complete, agent, kinds) for agent in ordered]
    if kinds == {True}:
        sentences.append("No episode is without a threat: false activations were not measured.")
    if kinds == {False}:
        sentences.append("No episode has a threat: avoidance was not measured.")
    return sentences


def _sweep_sentences(rows: list[Row], agents: list[str], suite: Suite) -> list[str]:
    """Return with which swept argument the outcome of each agent varies most."""
    complete = without_fcw_driver(rows)
    return [text for agent in agents for text in sweep_sentences(complete, agent, suite.by_name)]


def _agent_sentence(rows: list[Row], agent: str, kinds: set[bool]) -> str:
    """Return the sentence of one agent on the kinds of episodes, with and without a threat, in all rows."""
    summary = summarise(agent, "", [row for row in rows if row["agent"] == agent])
    avoided, false = summary.avoided, summary.false_activations
    parts: list[str] = []
    if True in kinds:
        parts.append(_avoided_text(summary) if avoided.n else "completed no threat")
    if False in kinds:
        missing = "completed no episode without a threat"
        parts.append(f"activated falsely in {_of(false, 'episode')} without a threat" if false.n else missing)
    if avoided.n + false.n == 0:
        parts = ["has no completed episode"]
    return f"{agent} {' and '.join(parts)}."


def _avoided_text(summary: AgentSummary) -> str:
    """Return the avoided threats, and those with premature braking, which are not avoided."""
    premature = summary.premature.k
    return f"avoided {_of(summary.avoided, 'threat')}" + (
        f" with premature braking in {premature} other{'s' if premature > 1 else ''}" if premature else ""
    )


def _of(rate: Rate, noun: str) -> str:
    """Return k of n with the interval; a zero keeps its n."""
    bounds = f"{100 * rate.low:.0f} to {100 * rate.high:.0f} %"
    return f"{rate.k} of {counted(rate.n, noun)} [{bounds}]"


def _limit_sentences(rows: list[Row], agents: list[str], suite: Suite) -> list[str]:
    """Return which agents meet the limits of the protocol in simulation; empty without limits."""
    if suite.limit is None:
        return []
    results = {agent: limit_results(rows, agent, suite) for agent in agents}
    tested = {agent: items for agent, items in results.items() if items}
    if not tested:
        return ["No episode allows a comparison with the limits of the protocol."]
    met = [
        f"{agent} {sum(item.met.k == item.met.n for item in items)} of {len(items)}"
        for agent, items in tested.items()
    ]
    sentences = [f"Cases in which every run meets the limit of the protocol in simulation: {', '.join(met)}."]
    verdict = verdict_text(rows, list(tested), suite)
    return [*sentences, f"{verdict[0].upper()}{verdict[1:]}."] if verdict else sentences


SENTENCE_END = re.compile(r"(?<=[^.].[.!?])(?=\s|$)")


def agent_note(text: str, trusted: bool = True) -> str:
    """Return one sentence on an agent: the summary of its class, or the card of its policy.

    The card of a policy is data; reading it does not load the model.

    Args:
        text: Agent string, see `lgmd_gym.agents.make_agent`.
        trusted: Whether a class from outside this package may be loaded.
    """
    name, _, rest = text.partition(":")
    if name == Policy.name:
        return _policy_note(rest)
    if name in AGENTS:
        return _first_sentence(AGENTS[name])
    if not trusted:
        return "A class from outside this package, which was not loaded."
    try:
        agent = make_agent(text)
    except Exception:  # any error of the user's module or constructor
        return "A class from outside this package, which cannot be loaded."
    objects: list[object] = getattr(agent.agent, "objects", [agent.agent])
    return _first_sentence(type(objects[0]))


def _first_sentence(kind: type) -> str:
    """Return the first sentence of a class docstring on one line, without Markdown marks."""
    text = inspect.getdoc(kind) if kind.__doc__ else None
    paragraph = " ".join((text or "").split("\n\n")[0].split()).replace("`", "")
    return SENTENCE_END.split(paragraph)[0] or "A class from outside this package, without a docstring."


def _policy_note(path: str) -> str:
    """Return the algorithm, cameras, inputs and demands of a policy."""
    try:
        file = find_policy(path)
        card, training = policy_card(file), read_card(file).get("config")
    except ValueError:
        return "A learned policy, whose card cannot be read."
    cameras = len(card.camera) if isinstance(card.camera, list | tuple) else 1
    inputs = (
        "the observations of the environment" if card.features is None else ", ".join(card.features.inputs)
    )
    if card.brake is not None:
        demands = "a brake with stages by the time to brake"
    else:
        demands = f"{len(card.demands)} levels of demand" if card.demands else "a continuous demand"
    sensors = counted(cameras, "camera")
    algo = cast(Values, training).get("algo") if isinstance(training, dict) else card.algo
    method = str(algo).upper() if card.brake is None else str(algo)
    return f"Learned policy ({method}) with {sensors}, the inputs {inputs}, and {demands}."
