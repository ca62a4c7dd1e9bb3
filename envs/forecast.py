"""Time to brake: how long full braking can wait, decided by forks of the episode.

A fork is a copy of the episode that the same compiled functions step on. So the result contains the delay,
build-up and strength of the episode's brake, the ego's script, the outlines and the exact contact.
"""

from math import inf

import numpy as np

from lgmd_gym.envs.dynamics.brake import put_demand
from lgmd_gym.envs.dynamics.episode import Arrays, Physics, is_truncated, step_environment
from lgmd_gym.envs.surrogate_safety import approaching
from lgmd_gym.fields import Record, flag, number, record
from lgmd_gym.kernels import kernel

TOLERANCE = 1e-3  # by which a severity must be higher to be worse
APPROACH = 300.0  # [s] within which a body on its way to the standing ego counts
STRUCK = (
    1.0  # severity of a contact while the ego stands; while it moves, the relative speed [m/s] adds to it
)
NEVER = 2**62  # decisions
UNKNOWN = -1
FORECAST = np.dtype(
    [("begun", np.int64), ("last", np.float64), ("ttb", np.float64)],
)
"""Forecast of an episode: number of begun segments for which `last` holds, or `UNKNOWN`; time of the last
moment for an ego that follows its script until then; present time to brake [s]."""


@record
class ForecastParams(Record):
    """How `info["ttb"]` is forecast, see `write_forecasts`."""

    share: float = number(
        1.0, "(0, 1]", "", "Share of the brake's full deceleration that is assumed to be available."
    )
    foresight: bool = flag(
        False,
        "Whether changes of speed that others have not yet begun are known, such as a lead car's braking.",
    )


@kernel(exact=True)
def write_forecasts(
    first: int,
    last: int,
    selected: np.ndarray,
    steps: int,
    rate: float,
    share: float,
    foresight: bool,
    physics: Arrays,
    fork: Arrays,
    forecasts: np.ndarray,
) -> None:
    """Write the time to brake of the selected environments.

    The time to brake is the longest time that the ego can follow its script (or regain it) before full
    braking, such that braking then is not worse than braking now. No contact is best, then one while the ego
    stands, then one at a lower relative speed. It is a whole number of decisions: 0 if braking must
    begin with the present one, `inf` if the script leads to no contact. It is found by bisection, because the
    ego is the farther ahead at any time, the later it brakes.

    Others are known to follow their paths, and to end what they have begun: a lead car that brakes is known
    to brake as its script states. With `foresight`, all of their scripts are known.

    Args:
        first: First environment.
        last: Last environment + 1.
        selected: The environments, bool, shape (N,).
        steps: Simulation steps per decision.
        rate: Simulation frequency [Hz].
        share: See `ForecastParams`.
        foresight: See `ForecastParams`.
        physics: `Physics`.
        fork: `Physics` of the forks; its state is overwritten.
        forecasts: Output, `FORECAST` records, shape (N,).
    """
    physics, fork = Physics(*physics), Physics(*fork)
    for i in range(first, last):
        if not selected[i]:
            continue
        forecast, episode = forecasts[i], physics.episodes[i]
        begun = 0 if foresight else _begun_segments(physics.bodies[i], episode.bodies, physics.segments[i])
        on_script = physics.egos[i].on_script > 0
        if not on_script or forecast.begun != begun:
            forecast.begun = begun if on_script else UNKNOWN
            forecast.last = episode.time + _time_to_brake(i, steps, rate, share, foresight, physics, fork)
        forecast.ttb = max(forecast.last - episode.time, 0.0)


@kernel(exact=True)
def _begun_segments(bodies: np.ndarray, count: int, segments: np.ndarray) -> int:
    """Return how many segments of the others' scripts have begun."""
    total = 0
    for k in range(1, count):
        total += bodies[k].segment + (1 if _has_begun(bodies[k], segments) else 0)
    return total


@kernel(exact=True)
def _has_begun(body: np.record, segments: np.ndarray) -> bool:
    """Return whether the body is in a segment of its script."""
    return body.segment < body.segment_end and segments[body.segment, 0] < body.script_time


@kernel(exact=True)
def _time_to_brake(
    i: int, steps: int, rate: float, share: float, foresight: bool, physics: Arrays, fork: Arrays
) -> float:
    """Return the time to brake of environment i [s]; see `write_forecasts`."""
    late, severity = _outcome(i, NEVER, steps, rate, share, foresight, physics, fork)
    if severity == 0.0:
        return inf
    _, least = _outcome(i, 0, steps, rate, share, foresight, physics, fork)
    if severity <= least + TOLERANCE:
        return late * steps / rate
    waiting = 0
    while late - waiting > 1:
        middle = (waiting + late) // 2
        _, severity = _outcome(i, middle, steps, rate, share, foresight, physics, fork)
        if severity <= least + TOLERANCE:
            waiting = middle
        else:
            late = middle
    return waiting * steps / rate


@kernel(exact=True)
def _outcome(
    i: int,
    waiting: int,
    steps: int,
    rate: float,
    share: float,
    foresight: bool,
    physics: Arrays,
    fork: Arrays,
) -> tuple[int, float]:
    """Return the outcome of a fork in which the ego brakes after `waiting` decisions.

    A fork ends at a contact; with the episode, while the ego waits; and when the ego has stopped, unless
    another is on its way to it, whose motion then goes on until it stops or, steadily, strikes the ego.

    Returns:
        Number of decisions up to the end, and severity of the contact, 0 for none, see `STRUCK`.
    """
    physics, fork = Physics(*physics), Physics(*fork)
    _copy(i, foresight, physics, fork)
    bodies, episode = fork.bodies[i], fork.episodes[i]
    ego, delay = bodies[0], fork.brakes[i].delay
    decision = 0
    while True:
        braking = decision >= waiting
        put_demand(fork.lines[i], fork.pending[i], delay, -share if braking else 0.0)
        for _ in range(steps):
            step_environment(i, 1.0 / rate, fork)
        decision += 1
        episode.time += steps / rate
        if episode.touched > 0:
            moving = episode.impact_speed > 0.0
            return decision, STRUCK + (max(episode.relative_impact_speed, 0.0) if moving else 0.0)
        if not braking:
            if is_truncated(episode):
                return decision, 0.0
        elif ego.speed == 0.0:
            other = approaching(bodies, episode.bodies, fork.paths[i], APPROACH, True)
            if other == 0:
                return decision, 0.0
            if bodies[other].segment == bodies[other].segment_end or is_truncated(episode):
                return decision, STRUCK


@kernel(exact=True)
def _copy(i: int, foresight: bool, physics: Arrays, fork: Arrays) -> None:
    """Copy the state of environment i to its fork, whose scripts end with what has begun."""
    physics, fork = Physics(*physics), Physics(*fork)
    count, segments = physics.episodes[i].bodies, physics.segments[i]
    fork.episodes[i], fork.egos[i], fork.lines[i] = physics.episodes[i], physics.egos[i], physics.lines[i]
    for k in range(physics.lines[i].count):
        fork.pending[i, k, 0], fork.pending[i, k, 1] = physics.pending[i, k, 0], physics.pending[i, k, 1]
    for k in range(count):
        fork.bodies[i, k] = physics.bodies[i, k]
        body = fork.bodies[i, k]
        if k > 0 and not foresight:
            body.segment_end = body.segment + (1 if _has_begun(body, segments) else 0)
