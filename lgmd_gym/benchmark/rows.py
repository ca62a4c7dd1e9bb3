"""Rows of `episodes.jsonl`, one per episode."""

from typing import Any

from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import Episode
from lgmd_gym.benchmark.metrics import METRICS, PREMATURE, Counterfactual, PairedEpisode, measure
from lgmd_gym.camera import CLEAR

Row = dict[str, Any]
RowKey = tuple[str, str, int, str]

ID_KEYS = ("agent", "suite", "case", "fcw_driver", "seed", "condition")
WORLD = "world"
"""Key of a row's world: its number, or null in the laboratory."""
# Every key of a row of a suite of cases, in order; null where undefined. The metrics' docstrings define them.
KEYS = (*ID_KEYS, WORLD, "camera", *METRICS, "error")


def key_of(row: Row) -> RowKey:
    """Return the key of a row, unique within its run: agent, case, seed, condition."""
    return row["agent"], row["case"], row["seed"], row["condition"]


def new_row(
    keys: tuple[str, ...], agent: str, case: Case, seed: int, condition: str = CLEAR, **values: Any
) -> Row:
    """Return a row with its identifying keys and `values` set and all other keys null."""
    identity = (agent, case.suite, case.name, case.fcw_driver, seed, condition)
    return dict.fromkeys(keys) | dict(zip(ID_KEYS, identity, strict=True)) | values


def make_row(
    agent: str,
    case: Case,
    seed: int,
    episode: Episode,
    counterfactual: Counterfactual,
    premature: float = PREMATURE,
    condition: str = CLEAR,
    camera: str | None = None,
) -> Row:
    """Return the row of one episode.

    Args:
        agent: Agent string.
        case: Case of the episode.
        seed: Seed of the episode.
        episode: Episode to measure.
        counterfactual: Outcome of `no-brake`, which defines a threat.
        premature: Lead before the counterfactual contact beyond which braking is premature [s].
        condition: Camera condition.
        camera: Camera names.
    """
    pair = PairedEpisode.of(episode, counterfactual, premature)
    return new_row(KEYS, agent, case, seed, condition, world=episode.world, camera=camera, **measure(pair))
