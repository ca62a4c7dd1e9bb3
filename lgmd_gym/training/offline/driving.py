# pyright: standard
# Not strict: Gymnasium states few types.
"""Recorder of levels with random braking, and of the time to brake at each of their decisions.

A policy that releases the brake must know what a threat looks like while the car brakes, and after a release.
So these episodes contain driving at constant demand, braking at any time, and driving after a release. The
engine forecasts the time to brake, see `lgmd_gym.envs.forecast`: one value says whether to brake, to warn and
to release.
"""

from collections import deque
from dataclasses import dataclass, field
from math import inf
from typing import Any

import gymnasium as gym
import numpy as np

from lgmd_gym.agents.base import FPS, HOLD
from lgmd_gym.aliases import Arguments
from lgmd_gym.engine import BrakingVectorEnv
from lgmd_gym.envs.forecast import ForecastParams
from lgmd_gym.training.offline.episodes import (
    DrivenEpisode,
    Observation,
    select_signals,
    stack,
)

NUM_ENVS = 4  # environments with cameras; more are slower, because fewer tables fit in the cache
STREAM = 911  # second part of the seed of a driver


class PulseDriver:
    """Brakes at random times for random durations; a function of the seed.

    Seven of twenty drivers never brake. Most others brake first at a random time to brake, up to 2.3 s before
    the last moment or shortly after it, the rest at a random time. A fifth of the pulses are partial. A
    quarter of the pulses last to the end of the episode.

    Args:
        seed: Seed of the episode.
    """

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng([seed, STREAM])
        self._brakes = self._rng.random() < 0.65
        # [s] of time to brake; below 0 for a delay after the last moment
        self._reserve = float(self._rng.uniform(-0.3, 2.3)) if self._rng.random() < 0.85 else -inf
        self._start = float(self._rng.uniform(0.0, 9.0))  # [s], the latest start of a pulse without a threat
        self._demand, self._until, self._late = HOLD, -1.0, 0.0

    def act(self, time: float, time_to_brake: float) -> float:
        """Return the demand of a decision in [-1, 0]; call it once per decision, in order.

        Args:
            time: Time of the decision [s].
            time_to_brake: Time to brake at the decision [s].
        """
        if not self._brakes or time < self._until:
            return self._demand
        if self._demand < HOLD:  # the pulse is over
            self._demand, self._reserve = HOLD, float(self._rng.uniform(-0.3, 2.3))
            self._start, self._late = time + float(self._rng.uniform(0.3, 6.0)), 0.0
        self._late += (time_to_brake <= 0.0) / FPS
        due = time_to_brake <= self._reserve or self._late >= -self._reserve > 0.0
        if due or time >= self._start:
            demand = -1.0 if self._rng.random() < 0.8 else self._rng.uniform(-0.6, -0.2)
            self._demand = float(np.float32(demand))  # as that of an action
            self._until = time + (float(self._rng.uniform(0.2, 2.5)) if self._rng.random() < 0.75 else inf)
        return self._demand


@dataclass
class _Drive:
    """A running episode."""

    family: str
    driver: PulseDriver | None  # None for holding the speed
    observations: list[Observation] = field(default_factory=list[Observation])
    times_to_brake: list[float] = field(default_factory=list[float])
    demands: list[float] = field(default_factory=list[float])

    def to_episode(self) -> DrivenEpisode:
        """Return the finished episode."""
        times = np.array(self.times_to_brake, np.float32)
        demands = np.array(self.demands, np.float32)
        threat = bool(np.isfinite(times).any())
        return DrivenEpisode(stack(self.observations), times, demands, threat, family=self.family)


@dataclass(frozen=True)
class DriveRecorder:
    """Records episodes of an environment that the engine covers, one per seed, with random braking."""

    env_id: str  # id of braking environments
    arguments: Arguments  # arguments of `gym.make_vec`; `camera` is required
    shrink: int | None = None  # see `select_signals`
    brakes: bool = True  # False for episodes that hold the speed

    def record(self, seeds: range) -> list[list[DrivenEpisode]]:
        """Return a list with one episode for each seed."""
        if not seeds:
            return []
        config = dict(self.arguments.get("config") or {})
        config["forecast"] = config.get("forecast") or ForecastParams().to_dict()
        arguments = self.arguments | {"config": config, "autoreset_mode": "Disabled"}
        made: Any = gym.make_vec(self.env_id, num_envs=min(NUM_ENVS, len(seeds)), **arguments)
        envs: BrakingVectorEnv = made.unwrapped
        drives: dict[int, _Drive] = {}
        try:
            self._drive(envs, deque(seeds), drives)
        finally:
            envs.close()
        return [[drives[seed].to_episode()] for seed in seeds]

    def _drive(self, envs: BrakingVectorEnv, waiting: deque[int], drives: dict[int, _Drive]) -> None:
        """Drive all episodes; an environment starts the next one as soon as it is free."""
        simulation, demands = envs.simulation, np.full(envs.num_envs, HOLD)
        forecasts = simulation.forecasts
        assert forecasts is not None  # by the configuration
        running: dict[int, _Drive] = {}
        observations: Any = None
        while waiting or running:
            free = [index for index in range(envs.num_envs) if index not in running]
            if waiting and free:
                seeds: list[int | None] = [None] * envs.num_envs
                mask = np.zeros(envs.num_envs, np.bool_)
                for index in free[: len(waiting)]:
                    seeds[index], mask[index] = waiting.popleft(), True
                observations, _ = envs.reset(seed=seeds, options={"reset_mask": mask})
                for index, seed in enumerate(seeds):
                    if seed is not None:
                        driver = PulseDriver(seed) if self.brakes else None
                        running[index] = drives[seed] = _Drive(envs.scenario_of(index).family, driver)
            active = np.zeros(envs.num_envs, np.bool_)
            for index, drive in running.items():
                time_to_brake = float(forecasts["ttb"][index])
                time = len(drive.demands) / FPS
                demands[index] = HOLD if drive.driver is None else drive.driver.act(time, time_to_brake)
                active[index] = True
                row = {name: values[index] for name, values in observations.items()}
                drive.observations.append(select_signals(row, self.shrink))
                drive.times_to_brake.append(time_to_brake)
                drive.demands.append(float(demands[index]))
            simulation.step(demands, active)
            observations = envs.read_observations()
            outcome = simulation.outcome
            ended = outcome.terminated | outcome.truncated
            running = {index: drive for index, drive in running.items() if not ended[index]}
