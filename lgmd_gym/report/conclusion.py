"""Conclusion of a run in plain English, generated from its rows."""

from lgmd_gym.benchmark.analysis.protocol_limits import LIMIT_CHECKS, R152_SUITES, limit_results, meets_r152
from lgmd_gym.benchmark.rows import Row
from lgmd_gym.benchmark.summary import (
    INTERVAL_TEXT,
    AgentSummary,
    Sample,
    by_condition,
    summarise,
    without_fcw_driver,
)
from lgmd_gym.benchmark.task import NO_BRAKE
from lgmd_gym.errors import counted
from lgmd_gym.statistics.intervals import Rate

CAVEAT = (
    "These are results of one simulation with the cases of this suite. They are not a rating and do not show "
    "how a real car would perform."
)


def conclusion(rows: list[Row], agents: list[str], suite: str) -> str:
    """Return one paragraph: sample, avoided threats, false activations and limits of each agent.

    Args:
        rows: Rows of a suite of cases. Rows with an FCW driver count for the limits only.
        agents: Agents in the order of the report.
        suite: Name of the suite, which selects the protocol limits.
    """
    conditions = by_condition(rows)
    braking = [agent for agent in agents if agent != NO_BRAKE]
    sentences = [_sample_sentence(rows, suite)]
    for condition, part in conditions.items():
        found = [*_agent_sentences(part, braking), *_limit_sentences(part, braking, suite)]
        sentences += ([f"Condition {condition}:"] if len(conditions) > 1 and found else []) + found
    failed = sum(row["error"] is not None for row in rows)
    if failed:
        sentences.append(
            f"{counted(failed, 'episode')} failed and {'is' if failed == 1 else 'are'} left out."
        )
    return " ".join([*sentences, CAVEAT])


def _sample_sentence(rows: list[Row], suite: str) -> str:
    """Return the sizes of the run, and in how many episodes `no-brake` has contact."""
    complete = [row for row in without_fcw_driver(rows) if row["error"] is None]
    base = [row for row in complete if row["agent"] == NO_BRAKE]
    threats = sum(bool(row["threat"]) for row in base)
    start = f"The run contains {counted(len(rows), 'episode')} of suite {suite} ({Sample.of(rows)})."
    contacts = f" Without braking, {threats} of {counted(len(base), 'episode')} end in contact (threats)."
    return f"{start}{contacts if base else ''} Brackets contain the {INTERVAL_TEXT}."


def _agent_sentences(rows: list[Row], agents: list[str]) -> list[str]:
    """Return the avoided threats and the false activations of each agent."""
    complete = [row for row in without_fcw_driver(rows) if row["error"] is None]
    kinds = {bool(row["threat"]) for row in complete}
    sentences = [_agent_sentence(complete, agent, kinds) for agent in agents]
    if kinds == {True}:
        sentences.append("No episode is without a threat: false activations were not measured.")
    if kinds == {False}:
        sentences.append("No episode has a threat: avoidance was not measured.")
    return sentences


def _agent_sentence(rows: list[Row], agent: str, kinds: set[bool]) -> str:
    """Return the sentence of one agent on the kinds of episodes, with and without a threat, in all rows."""
    summary = summarise(agent, "", [row for row in rows if row["agent"] == agent])
    avoided, false = summary.avoided, summary.false_activations
    parts = []
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


def _limit_sentences(rows: list[Row], agents: list[str], suite: str) -> list[str]:
    """Return which agents meet the limits of the protocol in simulation; empty without limits."""
    if suite not in LIMIT_CHECKS:
        return []
    results = {agent: limit_results(rows, agent, LIMIT_CHECKS[suite]) for agent in agents}
    tested = {agent: items for agent, items in results.items() if items}
    if not tested:
        return ["No episode allows a comparison with the limits of the protocol."]
    met = [
        f"{agent} {sum(item.met.k == item.met.n for item in items)} of {len(items)}"
        for agent, items in tested.items()
    ]
    sentences = [f"Cases in which every run meets the limit of the protocol in simulation: {', '.join(met)}."]
    if suite in R152_SUITES:
        names = ", ".join(agent for agent in tested if meets_r152(rows, agent)) or "none"
        sentences.append(f"Agents that meet the impact speed limits of UN R152 in simulation: {names}.")
    return sentences
