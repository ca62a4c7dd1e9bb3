"""What rules are scored on: drives without braking, recorded once, and what braking would make of them.

A rule that latches drives as `no-brake` does until it brakes, and then brakes to a standstill. So what its
eye sees can be recorded once, and the rule be asked on the record when it brakes; the outcome needs no eye.
"""

import json
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from lgmd_gym.agents import BRAKE, HOLD, Agent, Rule, make_agent
from lgmd_gym.benchmark.case import Case
from lgmd_gym.benchmark.episode import Episode, make_env, play
from lgmd_gym.benchmark.metrics import Counterfactual
from lgmd_gym.benchmark.rows import make_row
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.benchmark.task import Task, run_task

SEEDS_FROM = 1000  # of the false-reaction suite: reports count from 0
EYES = 4  # whose drives are kept: enough for a choice of lenses
TEXTURES = (0.5, 1.6)  # contrast of the asphalt, times the natural one
OWN = SensorConfig()  # each agent's own
BLIND = SensorConfig(camera={"name": "wide", "shape": [8, 8]})  # where nobody looks

Row = dict[str, Any]


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

    def value(self, false_cost: float) -> float:
        """Return what tuning maximises, with a false brake as dear as so many contacts at full speed."""
        return self.avoided_energy - false_cost * self.false_rate

    @classmethod
    def of(cls, rows: Iterable[Row]) -> "Score":
        """Return the score of episodes."""
        rows = list(rows)
        energy = [avoided_energy(row) for row in rows if row["threat"]]
        quiet = [float(row["false_activation"]) for row in rows if not row["threat"]]
        return cls(_mean(energy), _mean(quiet), len(energy), len(quiet))


@dataclass(frozen=True, slots=True)
class Drive:
    """A drive without braking, as an eye saw it.

    Attributes:
        case: The case.
        seed: The seed.
        truth: What it met.
        moments: Observation and the `lgmd/` keys of `info` at every decision, the last one included.
    """

    case: Case
    seed: int
    truth: Counterfactual
    moments: list[tuple[dict[str, Any], dict[str, Any]]]


class Recorder(Agent):
    """Never brakes, and keeps what it is shown."""

    def __init__(self) -> None:
        super().__init__()
        self.moments: list[tuple[dict[str, Any], dict[str, Any]]] = []

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Keep it, and hold the speed."""
        told = {key: value for key, value in info.items() if key.startswith("lgmd/")}
        self.moments.append((observation, told))
        return HOLD


class BrakeFrom(Agent):
    """Brakes fully from a decision on.

    Args:
        onset: Index of the decision; None for never.
    """

    def __init__(self, onset: int | None) -> None:
        super().__init__()
        self._left = onset

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Count down."""
        if self._left is None:
            return HOLD
        self._left -= 1
        return BRAKE if self._left < 0 else HOLD


class Ground:
    """Numbered levels and false-reaction cases, each with a texture of its own.

    Args:
        split: "train" or "validation".
        levels: Number of levels, from 0 on.
        seeds: Number of seeds of the false-reaction suite; 0 for none.
        jobs: Processes; 1 plays in this one.
    """

    def __init__(self, split: str, levels: int, seeds: int, jobs: int = 1) -> None:
        self.jobs = jobs
        self.places = [(_level(split, number), number) for number in range(levels)]
        quiet = find_suite("false-reaction").cases
        offset = SEEDS_FROM + (0 if split == "train" else SEEDS_FROM)
        self.places += [(case, offset + seed) for seed in range(seeds) for case in quiet]
        self._drives: dict[str, list[Drive]] = {}  # by eye, the last ones used
        self._outcomes: dict[tuple[int, int | None], Row] = {}

    def score(self, agent: str, sensor_config: SensorConfig = OWN) -> Score:
        """Score an agent's string on all of it.

        Args:
            agent: The string.
            sensor_config: What it sees through, where that is not left to the agent.

        Raises:
            RuntimeError: If an episode of an agent that does not latch fails; with its traceback.
        """
        made = make_agent(agent)
        if not latches(made):
            return Score.of(self._closed_loop(agent, sensor_config.of(made)))
        drives = self._seen_through(sensor_config.of(made))
        onsets = [onset(made, drive) for drive in drives]
        new = [key for key in enumerate(onsets) if key not in self._outcomes]
        told = ((*self.places[index], drives[index].truth, found) for index, found in new)
        rows = self._run(outcome, told)
        self._outcomes.update(zip(new, rows, strict=True))
        return Score.of(self._outcomes[key] for key in enumerate(onsets))

    def _seen_through(self, eye: SensorConfig) -> list[Drive]:
        """Return the drives through an eye, recorded anew if it is none of the last few."""
        told = json.dumps(asdict(eye.plain))
        drives = self._drives.pop(told, None)
        if drives is None:
            worn = ((*place, textured(eye, place[1])) for place in self.places)
            drives = self._run(record, worn)
        self._drives = dict([*self._drives.items(), (told, drives)][-EYES:])
        return drives

    def _closed_loop(self, agent: str, eye: SensorConfig) -> list[Row]:
        truths = self._run(blind_truth, self.places)
        tasks = (
            (Task(agent, case, seed, textured(eye, seed), truth),)
            for (case, seed), truth in zip(self.places, truths, strict=True)
        )
        rows = [result.row for result in self._run(run_task, tasks)]
        failed = next((row["error"] for row in rows if row["error"] is not None), None)
        if failed is not None:
            raise RuntimeError(failed)
        return rows

    def _run(self, function: Callable[..., Any], arguments: Iterable[tuple[Any, ...]]) -> list[Any]:
        results: Any = Parallel(n_jobs=self.jobs)(delayed(function)(*each) for each in arguments)
        return list(results)


def latches(agent: Any) -> bool:
    """Return whether an agent that has begun to brake will do so fully to the end."""
    return isinstance(agent, Rule) and agent.latching


def record(case: Case, seed: int, eye: SensorConfig) -> Drive:
    """Drive without braking and keep what an eye sees."""
    recorder = Recorder()
    episode = _played(case, seed, eye, recorder)
    return Drive(case, seed, Counterfactual.of(episode), recorder.moments)


def onset(rule: Any, drive: Drive) -> int | None:
    """Return the decision at which a rule that latches begins to brake; None for never."""
    rule.reset(drive.seed)
    for index, (observation, info) in enumerate(drive.moments):
        if float(rule.act(observation, info)[0]) < HOLD:
            return index
    return None


def outcome(case: Case, seed: int, truth: Counterfactual, found: int | None) -> Row:
    """Return the row of braking fully from a decision on."""
    return make_row("", case, seed, _played(case, seed, BLIND, BrakeFrom(found)), truth)


def blind_truth(case: Case, seed: int) -> Counterfactual:
    """Return what driving without braking meets."""
    return Counterfactual.of(_played(case, seed, BLIND, BrakeFrom(None)))


def textured(eye: SensorConfig, seed: int) -> SensorConfig:
    """Return an agent's eye with the texture that belongs to a seed."""
    rng = np.random.default_rng([7, seed])
    look = {"seed": 10_000 + seed, "texture": round(float(rng.uniform(*TEXTURES)), 3)}
    cameras = eye.camera if isinstance(eye.camera, list) else [eye.camera]
    worn = [{**({"name": item} if isinstance(item, str) else item), **look} for item in cameras]
    return replace(eye, camera=worn)


def avoided_energy(row: Row) -> float:
    """Return the share of the energy of the relative impact that braking took away; 0 if it was premature."""
    if row["premature_brake"]:
        return 0.0
    left = row["relative_impact_speed"] or 0.0
    without = row["speed_reduction"] + left
    return 1.0 - (left / without) ** 2 if without > 0.0 else 1.0


def _played(case: Case, seed: int, eye: SensorConfig, agent: Agent) -> Episode:
    env = make_env(case, eye)
    try:
        return play(env, agent, seed)
    finally:
        env.close()


def _level(split: str, number: int) -> Case:
    arguments = (("split", split), ("start_level", number), ("num_levels", 1))
    return Case(f"{split}/RandomBraking/{number}", "RandomBraking", arguments)


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else 0.0
