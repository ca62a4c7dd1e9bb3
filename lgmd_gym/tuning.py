"""Tuning of a rule's parameters on training levels, chosen on validation levels, kept in a study on disk.

Optuna proposes parameters within the ranges that a rule's fields state. A trial plays numbered levels of
`LGMD/RandomBraking-v0` and the false-reaction suite with seeds that reports never use, each with a texture of
its own. The protocol suites and the test split are never touched.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents import AGENTS, Rule, make_agent
from lgmd_gym.benchmark.cases import Case
from lgmd_gym.benchmark.eyesight import DEFAULT_CAMERA, Eyesight
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.tasks import NO_BRAKE, Task, run_task
from lgmd_gym.errors import unknown_name

FALSE_COST = 4.0  # a false brake weighs as much as four contacts at full speed
SEEDS_FROM = 1000  # of the false-reaction suite: reports count from 0
TEXTURES = (0.5, 1.6)  # contrast of the asphalt, times the natural one
SHIFT = 0.2  # of each parameter in the sensitivity table


@dataclass(frozen=True, slots=True)
class Score:
    """How well parameters do.

    Attributes:
        avoided_energy: Mean share of the impact energy that is avoided where there is a threat; none of it
            where the brake is premature.
        false_rate: Share of the quiet episodes with a false brake.
        threats: Number of episodes with a threat.
        quiet: Number of episodes without.
    """

    avoided_energy: float
    false_rate: float
    threats: int
    quiet: int

    @property
    def value(self) -> float:
        """What tuning maximises."""
        return self.avoided_energy - FALSE_COST * self.false_rate


class Ground:
    """The episodes that parameters are scored on, with their counterfactuals played once.

    Args:
        split: "train" or "validation".
        levels: Number of levels, from 0 on.
        seeds: Number of seeds of the false-reaction suite; 0 for none.
        jobs: Processes; 1 plays in this one.
    """

    def __init__(self, split: str, levels: int, seeds: int, jobs: int = 1) -> None:
        self.jobs = jobs
        places = [(_level(split, number), number) for number in range(levels)]
        quiet = find_suite("false-reaction").cases
        offset = SEEDS_FROM + (0 if split == "train" else SEEDS_FROM)
        places += [(case, offset + seed) for seed in range(seeds) for case in quiet]
        played = self._run(Task(NO_BRAKE, case, seed, Eyesight()) for case, seed in places)
        self.truths = [(result.task.case, result.task.seed, result.truth) for result in played]

    def score(self, agent: str) -> Score:
        """Play an agent's string on all of it.

        Raises:
            RuntimeError: If an episode fails; with its traceback.
        """
        made = make_agent(agent)
        tasks = (Task(agent, case, seed, _textured(made, seed), truth) for case, seed, truth in self.truths)
        rows = [result.row for result in self._run(tasks)]
        threats = [row for row in rows if row["threat"]]
        quiet = [row["false_brake"] for row in rows if not row["threat"]]
        energy = [0.0 if row["premature_brake"] else _avoided_energy(row) for row in threats]
        return Score(_mean(energy), _mean(quiet), len(threats), len(quiet))

    def _run(self, tasks: Iterable[Task]) -> list[Any]:
        results: Any = Parallel(n_jobs=self.jobs)(delayed(run_task)(task) for task in tasks)
        for result in results:
            if result.row["error"] is not None:
                raise RuntimeError(result.row["error"])
        return list(results)


def tune(
    agent: str,
    study: Path,
    trials: int,
    train: Ground,
    validation: Ground,
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
        study_name=agent,
        storage=f"sqlite:///{study}",
        sampler=optuna.samplers.TPESampler(seed=len(agent)),
        direction="maximize",
        load_if_exists=True,
    )
    if not search.trials:
        search.enqueue_trial(defaults(rule))

    def objective(trial: Any) -> float:
        score = train.score(spelled(agent, _proposed(trial, rule)))
        tell(f"trial {trial.number}: {_told(score)}")
        return score.value

    search.optimize(objective, n_trials=trials)
    done = [trial for trial in search.trials if trial.value is not None]
    ranked = sorted(done, key=lambda trial: trial.value or 0.0, reverse=True)[:best_of]
    found = [defaults(rule), *(dict(trial.params) for trial in ranked)]
    scored = [(validation.score(spelled(agent, item)), item) for item in found]
    for score, item in scored:
        tell(f"validation: {_told(score)}  {spelled(agent, item)}")
    return max(scored, key=lambda pair: pair[0].value)[1]


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


def defaults(rule: type[Rule]) -> dict[str, Any]:
    """Return a rule's parameters at their defaults."""
    return {item.name: item.default for item in fields(rule.Params)}


def spelled(agent: str, options: dict[str, Any]) -> str:
    """Return the string of an agent with options."""
    return f"{agent}:" + ",".join(f"{name}={value!r}" for name, value in options.items())


def _proposed(trial: Any, rule: type[Rule]) -> dict[str, Any]:
    proposed: dict[str, Any] = {}
    for item in fields(rule.Params):
        low, high = item.metadata["range"]
        whole = isinstance(item.default, int)
        proposed[item.name] = (trial.suggest_int if whole else trial.suggest_float)(item.name, low, high)
    return proposed


def _level(split: str, number: int) -> Case:
    arguments = (("split", split), ("start_level", number), ("num_levels", 1))
    return Case(f"{split}/RandomBraking/{number}", "RandomBraking", arguments)


def _textured(agent: Any, seed: int) -> Eyesight:
    """Return an agent's own eye with the texture that belongs to a seed."""
    eye = Eyesight().of(agent)
    rng = np.random.default_rng([7, seed])
    look = {"seed": 10_000 + seed, "texture": round(float(rng.uniform(*TEXTURES)), 3)}
    cameras = eye.camera if isinstance(eye.camera, list) else [eye.camera or DEFAULT_CAMERA]
    worn = [{**({"name": item} if isinstance(item, str) else item), **look} for item in cameras]
    return Eyesight(worn, eye.params, eye.condition, eye.include_frame)


def _avoided_energy(row: dict[str, Any]) -> float:
    """Return the share of the energy of the relative impact that braking took away."""
    left = row["relative_impact_speed"] or 0.0
    without = row["speed_reduction"] + left
    return 1.0 - (left / without) ** 2 if without > 0.0 else 1.0


def _mean(values: list[Any]) -> float:
    return float(np.mean(values)) if values else 0.0


def _told(score: Score) -> str:
    return (
        f"{score.value:.3f} = {score.avoided_energy:.3f} energy avoided (n = {score.threats}) "
        f"- {FALSE_COST:g} * {score.false_rate:.3f} false (n = {score.quiet})"
    )
