"""Tuning of a rule's parameters on training levels, chosen on validation levels, kept in a study on disk.

Optuna proposes parameters within the ranges that a rule's fields state; those that place its cameras stay as
they are. A trial is scored on numbered levels of `LGMD/RandomBraking-v0` and on the false-reaction suite with
seeds that reports never use, each with a texture of its own. The protocol suites and the test split are never
touched.
"""

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

from lgmd_gym.agents import AGENTS, Rule
from lgmd_gym.errors import unknown_name
from lgmd_gym.tuning_ground import Ground, Score

FALSE_COST = 1.0  # a false brake weighs as much as a contact at full speed
SHIFT = 0.2  # of each parameter in the sensitivity table


def tune(
    agent: str,
    study: Path,
    trials: int,
    train: Ground,
    validation: Ground,
    false_cost: float = FALSE_COST,
    best_of: int = 3,
    tell: Callable[[str], None] = print,
) -> dict[str, float | int]:
    """Search parameters of a rule and return those that validation chooses; a known study is gone on with.

    Args:
        agent: Name of a rule.
        study: SQLite file of the study; made if missing.
        trials: How many to add.
        train: What trials are scored on.
        validation: What chooses among the best.
        false_cost: What a false brake costs, in contacts at full speed; a study has one.
        best_of: How many of the best trials, beside the defaults, go to validation.
        tell: Called with a line per result.

    Raises:
        ValueError: For an agent that is no rule, or if Optuna is not installed.
    """
    rule = tunable(agent)
    try:
        import optuna
    except ImportError:
        raise ValueError("tune needs Optuna; pip install 'lgmd-gym[train]'") from None
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    search = optuna.create_study(
        study_name=f"{agent} at {false_cost:g}",
        storage=f"sqlite:///{study}",
        sampler=optuna.samplers.TPESampler(seed=len(agent)),
        direction="maximize",
        load_if_exists=True,
    )
    if not search.trials:
        search.enqueue_trial(
            {name: value for name, value in defaults(rule).items() if name in searched(rule)}
        )

    def objective(trial: Any) -> float:
        score = train.score(spelled(agent, _proposed(trial, rule)))
        tell(f"trial {trial.number}: {_told(score, false_cost)}")
        return score.value(false_cost)

    search.optimize(objective, n_trials=trials)
    done = [trial for trial in search.trials if trial.value is not None]
    ranked = sorted(done, key=lambda trial: trial.value or 0.0, reverse=True)[:best_of]
    found = [defaults(rule), *(dict(trial.params) for trial in ranked)]
    scored = [(validation.score(spelled(agent, item)), item) for item in found]
    for score, item in scored:
        tell(f"validation: {_told(score, false_cost)}  {spelled(agent, item)}")
    return max(scored, key=lambda pair: pair[0].value(false_cost))[1]


def sensitivity(agent: str, ground: Ground) -> list[tuple[str, float | int, Score]]:
    """Return the score with each parameter of a rule lowered and raised by a fifth, the others at default.

    Whole numbers move by at least one.
    """
    rule, rows = tunable(agent), []
    for name, value in defaults(rule).items():
        for sign in (-1, 1):
            moved: float | int = value * (1 + sign * SHIFT)
            if isinstance(value, int):
                moved = max(1, value + sign * max(1, round(SHIFT * value)))
            rows.append((name, moved, ground.score(f"{agent}:{name}={moved:.6g}")))
    return rows


def tunable(agent: str) -> type[Rule]:
    """Return the class of a rule, or raise ValueError that names the nearest rule."""
    rules = {name: cls for name, cls in AGENTS.items() if issubclass(cls, Rule)}
    if agent not in rules:
        raise unknown_name("rule", agent, rules)
    return rules[agent]


def searched(rule: type[Rule]) -> list[str]:
    """Return the names of the parameters that tuning searches: all but those that place the cameras."""
    return [item.name for item in fields(rule.Params) if not item.metadata.get("places_eye")]


def defaults(rule: type[Rule]) -> dict[str, Any]:
    """Return a rule's parameters at their defaults."""
    return {item.name: item.default for item in fields(rule.Params)}


def spelled(agent: str, options: dict[str, Any]) -> str:
    """Return the string of an agent with options."""
    return f"{agent}:" + ",".join(f"{name}={value!r}" for name, value in options.items())


def _proposed(trial: Any, rule: type[Rule]) -> dict[str, Any]:
    proposed: dict[str, Any] = {}
    for item in fields(rule.Params):
        if item.name not in searched(rule):
            continue
        low, high = item.metadata["range"]
        whole = isinstance(item.default, int)
        proposed[item.name] = (trial.suggest_int if whole else trial.suggest_float)(item.name, low, high)
    return proposed


def _told(score: Score, false_cost: float) -> str:
    return (
        f"{score.value(false_cost):.3f} = {score.avoided_energy:.3f} energy avoided (n = {score.threats}) "
        f"- {false_cost:g} * {score.false_rate:.3f} false (n = {score.quiet})"
    )
