"""From an episode and its counterfactual to one row of `episodes.jsonl`."""

from typing import Any

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.metrics import METRICS, PREMATURE, Counterfactual, Outcome, measure
from lgmd_gym.benchmark.sensors import CLEAR

NAMED = ("agent", "suite", "case", "fcw_driver", "seed", "condition")
# Every key of a row in its order; null where undefined. The metrics' docstrings say what each is.
KEYS = (*NAMED, "camera", *METRICS, "error")

RowKey = tuple[str, str, int, str]


def key_of(row: dict[str, Any]) -> RowKey:
    """Return what tells a row from all others of its run: agent, case, seed, condition."""
    return row["agent"], row["case"], row["seed"], row.get("condition", CLEAR)


def make_row(
    agent: str,
    case: Case,
    seed: int,
    episode: Episode,
    truth: Counterfactual,
    premature: float = PREMATURE,
    condition: str = CLEAR,
) -> dict[str, Any]:
    """Return the row of one episode.

    Args:
        agent: The agent's string.
        case: The case played.
        seed: The seed played.
        episode: What happened.
        truth: What happens to `no-brake`; decides what is a threat.
        premature: Braking earlier than this before the counterfactual contact is no success [s].
        condition: The camera's condition.
    """
    named = _named(agent, case, seed, condition)
    return dict.fromkeys(KEYS) | named | measure(Outcome.of(episode, truth, premature))


def error_row(agent: str, case: Case, seed: int, error: str, condition: str = CLEAR) -> dict[str, Any]:
    """Return the row of an episode that could not be played to its end."""
    return dict.fromkeys(KEYS) | _named(agent, case, seed, condition) | {"error": error}


def _named(agent: str, case: Case, seed: int, condition: str) -> dict[str, Any]:
    return dict(zip(NAMED, (agent, case.suite, case.name, case.fcw_driver, seed, condition), strict=True))
