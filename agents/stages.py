"""Stages of a brake: warning, partial braking, full braking, release; and the hold at standstill.

An agent judges the evidence of a threat at each decision, and `next_stages` decides what the brake does. The
brake rises at once to the stage that the evidence calls for. It falls only when the evidence has been absent
for a time, and then to no braking: a brake whose stage followed every change of the evidence would pump.
"""

from enum import IntEnum
from math import inf

import numpy as np

from lgmd_gym.fields import Record, number, record


class Evidence(IntEnum):
    """Evidence of a threat, in ascending order; the last three call for the stage of the same name."""

    CLEAR = 0  # no threat is seen: a brake is released after `StageParams.release_s`
    PRESENT = 1  # not enough to begin a stage, enough to keep it
    WARNING = 2  # warn the driver
    PARTIAL = 3  # brake partially
    FULL = 4  # brake fully


@record
class StageParams(Record):
    """What a brake does at the evidence of a threat."""

    label = "brake"

    release_s: float = number(
        inf,
        "[0, inf]",
        "s",
        "Time without evidence after which a stage ends; inf for a brake that latches to the episode's end.",
    )
    partial_demand: float = number(
        0.25,
        "(0, 1]",
        "",
        "Demand of partial braking as a share of full braking; 0.25 of 9 m/s² is below the 0.25 g from which "
        "braking without a threat counts as a false activation.",
    )
    hold_speed: float = number(
        1.5,
        "[0, inf)",
        "m/s",
        "Ego speed up to which a brake is not released: it holds the standing car.",
    )


def next_stages(
    stages: np.ndarray,
    clear_s: np.ndarray,
    evidence: np.ndarray,
    speeds: np.ndarray,
    params: StageParams,
    decision_s: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the stages of the brakes after a decision, and the times without evidence.

    Args:
        stages: Stages before the decision, int64, shape (N,): 0, or one of the last three `Evidence`.
        clear_s: Times for which the evidence has been `CLEAR`, float64, shape (N,) [s].
        evidence: `Evidence` at the decision, int64, shape (N,).
        speeds: Ego speeds, shape (N,) [m/s].
        params: Parameters of the brake.
        decision_s: Duration of a decision [s].
    """
    clear_s = np.where(evidence == Evidence.CLEAR, clear_s + decision_s, 0.0)
    held = (stages >= Evidence.PARTIAL) & (speeds <= params.hold_speed)
    ended = (evidence == Evidence.CLEAR) & (clear_s > params.release_s - 1e-9) & ~held
    called = np.where(evidence >= Evidence.WARNING, evidence, 0)
    return np.where(ended, 0, np.maximum(stages, called)), clear_s


def demands_of(stages: np.ndarray, params: StageParams) -> np.ndarray:
    """Return the longitudinal demands of stages in [-1, 0], float64, shape (N,)."""
    partial = np.where(stages == Evidence.PARTIAL, -params.partial_demand, 0.0)
    return np.where(stages == Evidence.FULL, -1.0, partial)
