"""Search of a rule's parameters with Optuna, and their sensitivity.

Trials are evaluated on training levels and false-reaction cases, and the result is chosen on validation
levels. Test levels and the protocol suites are not used.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lgmd_gym.processes.extras import missing_extra
from lgmd_gym.tuning.objective import Objective, ObjectiveValue
from lgmd_gym.tuning.space import Proposal, SearchSpace, agent_string, rule_options, sensor_config

FALSE_COST = 1.0  # cost of a false activation, relative to a contact at full speed


def tune(
    space: SearchSpace,
    study: Path,
    trials: int,
    train: Objective,
    validation: Objective,
    false_cost: float = FALSE_COST,
    best_of: int = 3,
    log: Callable[[str], None] = print,
) -> Proposal:
    """Search a space and return the parameters with the highest value on the validation objective.

    Args:
        space: Search space.
        study: SQLite file of the study; an existing study is resumed.
        trials: Number of trials to add.
        train: Objective of the trials.
        validation: Objective that chooses between the defaults and the best trials.
        false_cost: Cost of a false activation, relative to a contact at full speed.
        best_of: Number of best trials to evaluate on `validation`, in addition to the defaults.
        log: Function that receives one line per result.

    Raises:
        ValueError: If Optuna is not installed, or the study cannot be read or written.
    """
    try:
        from optuna.exceptions import OptunaError
        from sqlalchemy.exc import SQLAlchemyError
    except ImportError:
        raise missing_extra("tune", "train") from None

    def evaluate_trial(number: int, proposal: Proposal) -> float:
        value = evaluate(space, proposal, train)
        log(f"trial {number}: {_format_value(value, false_cost)}")
        return value.total(false_cost)

    name = f"{space.label} at {false_cost:g}"
    try:
        best = _best_trials(space, study, name, trials, evaluate_trial)[:best_of]
    except (OptunaError, SQLAlchemyError) as error:
        reason = str(getattr(error, "orig", None) or error.__cause__ or error).splitlines()[0]
        raise ValueError(
            f"study {str(study)!r} cannot be used ({reason}); check the path, or choose another --study"
        ) from None
    candidates = [space.defaults(), *best]
    evaluated = [(evaluate(space, proposal, validation), proposal) for proposal in candidates]
    for value, proposal in evaluated:
        log(f"validation: {_format_value(value, false_cost)}  {_format_proposal(space, proposal)}")
    return max(evaluated, key=lambda pair: pair[0].total(false_cost))[1]


def _best_trials(
    space: SearchSpace, file: Path, name: str, count: int, evaluate_trial: Callable[[int, Proposal], float]
) -> list[Proposal]:
    """Add `count` trials to a study and return the parameters of all its trials, best first.

    The seed of each trial depends on the number of complete trials only. An interrupted and resumed study
    therefore makes the same proposals as one without an interruption.
    """
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)  # a warning shows the traceback of an interruption
    study = optuna.create_study(
        study_name=name, storage=f"sqlite:///{file}", direction="maximize", load_if_exists=True
    )

    def complete() -> list[Any]:
        return study.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))

    for number in range(done := len(complete()), done + count):
        if number == 0:
            study.enqueue_trial(space.defaults())
        (seed,) = np.random.SeedSequence([len(space.agent), number]).generate_state(1)
        study.sampler = optuna.samplers.TPESampler(seed=int(seed))
        study.optimize(lambda trial, number=number: evaluate_trial(number, space.propose(trial)), n_trials=1)
    ranked = sorted(complete(), key=lambda trial: trial.value or 0.0, reverse=True)
    return [dict(trial.params) for trial in ranked]


def sensitivity(space: SearchSpace, objective: Objective) -> list[tuple[str, float | int, ObjectiveValue]]:
    """Return name, value and result for each parameter shifted by 20 % down and up, one at a time."""
    return [(name, value, evaluate(space, shifted, objective)) for name, value, shifted in space.shifts()]


def evaluate(space: SearchSpace, proposal: Proposal, objective: Objective) -> ObjectiveValue:
    """Return the objective value of a proposal."""
    return objective.evaluate(agent_string(space.agent, proposal), sensor_config(proposal))


def _format_proposal(space: SearchSpace, proposal: Proposal) -> str:
    others = {name: value for name, value in proposal.items() if name not in rule_options(proposal)}
    return " ".join([agent_string(space.agent, proposal), *(f"{name}={others[name]!r}" for name in others)])


def _format_value(value: ObjectiveValue, false_cost: float) -> str:
    return (
        f"{value.total(false_cost):.3f} = {value.avoided_energy:.3f} energy avoided (n = {value.threats}) "
        f"- {false_cost:g} * {value.false_rate:.3f} false (n = {value.non_threats})"
    )
