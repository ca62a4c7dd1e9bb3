"""Which episodes a report shows: by rule, so that nobody picks the flattering ones."""

from typing import Any

from lgmd_gym.benchmark.analysis.protocol_limits import impact
from lgmd_gym.benchmark.summary import case_order
from lgmd_gym.benchmark.task import NO_BRAKE

Row = dict[str, Any]
GALLERY = 12
BLIND = (NO_BRAKE, "always-brake", "random-brake", "ttc-oracle")  # who does not look at the neuron


def seen_agent(agents: list[str]) -> str:
    """Return the first agent that looks through the eye; else the first that can brake."""
    by_name = [agent for agent in agents if agent.split(":")[0] not in BLIND]
    return next(iter([*by_name, *(agent for agent in agents if agent != NO_BRAKE), NO_BRAKE]))


def first_seed(rows: list[Row]) -> int:
    """Return the seed whose time series are kept of every agent."""
    return min((row["seed"] for row in rows), default=0)


def telling_cases(rows: list[Row], agent: str) -> dict[str, Row]:
    """Return why an episode is shown, and the episode: the extremes of the traced seed."""
    first = first_seed(rows)
    own = [
        row
        for row in sorted(rows, key=lambda row: case_order(row["case"]))
        if row["agent"] == agent and row["seed"] == first and row["error"] is None
    ]
    avoided = [row for row in own if row["avoided"]]
    contacts = [row for row in own if row["collision"]]
    false = [row for row in own if row["false_activation"]]
    quiet = [row for row in own if not row["threat"] and not row["false_activation"]]
    early = [row for row in own if row["premature_brake"]]
    margin = [row for row in avoided if row["stopping_margin"] is not None]
    found: dict[str, Row] = {}
    if margin:
        found["narrowest stop"] = min(margin, key=lambda row: row["stopping_margin"])
    if avoided:
        found["fastest threat avoided"] = max(avoided, key=lambda row: row["ego_speed"])
    if contacts:
        found["hardest contact"] = max(contacts, key=impact)
    if early:
        found["braked prematurely"] = early[0]
    if false:
        found["hardest false braking"] = max(false, key=lambda row: row["peak_deceleration"])
    if quiet:
        found["fastest quiet drive"] = max(quiet, key=lambda row: row["ego_speed"])
    return found


def false_reactions(rows: list[Row], agents: list[str]) -> list[Row]:
    """Return the traced seed's false brakings by agents that look, the hardest first, at most a dozen."""
    looking = [agent for agent in agents if agent.split(":")[0] not in BLIND]
    first = first_seed(rows)
    found = [
        row
        for row in rows
        if row["error"] is None
        and row["false_activation"]
        and row["seed"] == first
        and row["agent"] in looking
    ]
    return sorted(found, key=lambda row: (-row["peak_deceleration"], row["case"], row["agent"]))[:GALLERY]
