"""Search of a rule's parameters with Optuna, and their sensitivity.

Trials are evaluated on training levels and false-reaction cases, and the result is chosen on validation
levels. Test levels and the protocol suites are not used.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

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
        ValueError: If Optuna is not installed.
    """
    try:
        import optuna
    except ImportError:
        raise ValueError("tune requires Optuna; pip install 'lgmd-gym[train]'") from None
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

    def run_trial(trial: Any) -> float:
        value = evaluate(space, space.propose(trial), train)
        log(f"trial {trial.number}: {_format_value(value, false_cost)}")
        return value.total(false_cost)

    search.optimize(run_trial, n_trials=trials)
    finished = [trial for trial in search.trials if trial.value is not None]
    best = sorted(finished, key=lambda trial: trial.value or 0.0, reverse=True)[:best_of]
    candidates = [space.defaults(), *(dict(trial.params) for trial in best)]
    evaluated = [(evaluate(space, proposal, validation), proposal) for proposal in candidates]
    for value, proposal in evaluated:
        log(f"validation: {_format_value(value, false_cost)}  {_format_proposal(space, proposal)}")
    return max(evaluated, key=lambda pair: pair[0].total(false_cost))[1]


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
