"""Tuning of a rule's parameters on training levels, chosen on validation levels, kept in a study on disk.

Optuna proposes parameters within the ranges that a rule's fields state and, on demand, a lens, what places
the rule's own cameras, and parameters of the neuron. A trial is scored on numbered levels of
`LGMD/RandomBraking-v0` and on the false-reaction suite with seeds that reports never use, each with a texture
of its own. The protocol suites and the test split are never touched.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lgmd_gym.tuning.objective import Ground, Score
from lgmd_gym.tuning.space import Proposal, Space, rule_options, sensor_config, spelled

FALSE_COST = 1.0  # a false brake weighs as much as a contact at full speed


def tune(
    space: Space,
    study: Path,
    trials: int,
    train: Ground,
    validation: Ground,
    false_cost: float = FALSE_COST,
    best_of: int = 3,
    tell: Callable[[str], None] = print,
) -> Proposal:
    """Search a space and return what validation chooses; a known study is gone on with.

    Args:
        space: What is searched.
        study: SQLite file of the study; made if missing.
        trials: How many to add.
        train: What trials are scored on.
        validation: What chooses among the best.
        false_cost: What a false brake costs, in contacts at full speed; a study has one.
        best_of: How many of the best trials, beside the defaults, go to validation.
        tell: Called with a line per result.

    Raises:
        ValueError: If Optuna is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise ValueError("tune needs Optuna; pip install 'lgmd-gym[train]'") from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    search = optuna.create_study(
        study_name=f"{space.label} at {false_cost:g}",
        storage=f"sqlite:///{study}",
        sampler=optuna.samplers.TPESampler(seed=len(space.agent)),
        direction="maximize",
        load_if_exists=True,
    )
    if not search.trials:
        search.enqueue_trial(space.defaults())

    def objective(trial: Any) -> float:
        score = scored(space, space.propose(trial), train)
        tell(f"trial {trial.number}: {_told(score, false_cost)}")
        return score.value(false_cost)

    search.optimize(objective, n_trials=trials)
    done = [trial for trial in search.trials if trial.value is not None]
    ranked = sorted(done, key=lambda trial: trial.value or 0.0, reverse=True)[:best_of]
    found = [space.defaults(), *(dict(trial.params) for trial in ranked)]
    judged = [(scored(space, item, validation), item) for item in found]
    for score, item in judged:
        tell(f"validation: {_told(score, false_cost)}  {_named(space, item)}")
    return max(judged, key=lambda pair: pair[0].value(false_cost))[1]


def sensitivity(space: Space, ground: Ground) -> list[tuple[str, float | int, Score]]:
    """Return the score with each parameter lowered and raised by a fifth, the others at their defaults."""
    return [(name, value, scored(space, shifted, ground)) for name, value, shifted in space.shifts()]


def scored(space: Space, proposal: Proposal, ground: Ground) -> Score:
    """Return the score of a proposal."""
    return ground.score(spelled(space.agent, proposal), sensor_config(proposal))


def _named(space: Space, proposal: Proposal) -> str:
    eye = {name: value for name, value in proposal.items() if name not in rule_options(proposal)}
    return " ".join([spelled(space.agent, proposal), *(f"{name}={value!r}" for name, value in eye.items())])


def _told(score: Score, false_cost: float) -> str:
    return (
        f"{score.value(false_cost):.3f} = {score.avoided_energy:.3f} energy avoided (n = {score.threats}) "
        f"- {false_cost:g} * {score.false_rate:.3f} false (n = {score.quiet})"
    )
