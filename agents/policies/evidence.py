"""Evidence of a policy that estimates the time to brake: how long full braking can still wait."""

from functools import lru_cache
from math import inf

import numpy as np

from lgmd_gym.agents.stages import Evidence, StageParams
from lgmd_gym.errors import check_items, check_positive, shown
from lgmd_gym.fields import number, record, value

MAX_ODDS = 50.0  # means never
ODDS = f"[-{MAX_ODDS:g}, {MAX_ODDS:g}]"
# The outputs of a network that torch runs depend on the size of the batch, because the order of float32 sums
# does. The differences are near 1e-6. A distance from every threshold beyond this limit does not depend on
# them.
SAFE_DISTANCE = 1e-3


def _check_limits(name: str, limits: object) -> tuple[float, ...]:
    values = tuple(check_positive(name, item) for item in check_items(name, limits, object, "numbers"))
    if not values or list(values) != sorted(set(values)):
        raise ValueError(f"{name} must be ascending numbers, at least one, got {shown(limits)}")
    return values


@record
class TimeToBrakeParams(StageParams):
    """A brake with stages for a policy whose actions are intervals of the time to brake.

    Action k of the policy stands for a time to brake below `limits_s[k]` and not below the limit before it;
    the last action for a longer one, or none. The log odds of a time to brake below a limit are those of the
    sum of the probabilities of the actions up to it. A threshold of 50, the upper end of the range, means
    never: neither a margin nor extreme logits reach it. One of -50 means always.

    Partial and full braking require `confirm_odds` in addition. A network is less certain of the moment than
    of the threat, so that two thresholds, for a short and a long time, tell threats from other road users
    better than one.

    While the driver brakes, partial and full braking require `driver_odds` more of both. The driver has seen
    the road user, and the time to brake is that of an ego that holds its speed.
    """

    label = "brake"

    limits_s: tuple[float, ...] = value(
        (0.3, 0.6, 1.2, 2.6), _check_limits, "Upper ends of the intervals, ascending", "(0, inf)", "s"
    )
    full_s: float = number(0.6, "(0, inf)", "s", "Time to brake, one of `limits_s`, for full braking.")
    full_odds: float = number(0.0, ODDS, "", "Log odds from which on the policy brakes fully.")
    partial_s: float = number(1.2, "(0, inf)", "s", "The same limit for partial braking.")
    partial_odds: float = number(50.0, ODDS, "", "Log odds for partial braking; 50 for never.")
    warning_s: float = number(2.6, "(0, inf)", "s", "The same limit for the warning.")
    warning_odds: float = number(0.0, ODDS, "", "Log odds for the warning.")
    present_s: float = number(2.6, "(0, inf)", "s", "The same limit for keeping a stage.")
    present_odds: float = number(-2.0, ODDS, "", "Log odds from which on a stage is kept.")
    confirm_odds: float = number(
        -50.0,
        ODDS,
        "",
        "Log odds of the same limit that partial and full braking require in addition; -50 for no condition.",
    )
    driver_odds: float = number(
        0.0,
        "[0, 50]",
        "",
        "Log odds added to the thresholds of partial and full braking while the driver brakes.",
    )
    driver_deceleration: float = number(
        2.0, "(0, inf)", "m/s²", "Deceleration from which on the driver brakes, unless the agent does."
    )

    def check(self) -> None:
        """Raise ValueError for a stage at a time to brake that the policy does not distinguish."""
        for name in ("full_s", "partial_s", "warning_s", "present_s"):
            if getattr(self, name) not in self.limits_s:
                limits = ", ".join(f"{limit:g}" for limit in self.limits_s)
                raise ValueError(f"{name} must be one of limits_s, {limits}, got {getattr(self, name):g}")

    @property
    def num_actions(self) -> int:
        """Number of actions of the policy."""
        return len(self.limits_s) + 1

    def odds(self, logits: np.ndarray) -> np.ndarray:
        """Return the log odds of a time to brake below each limit, float64, shape (N, limits).

        Args:
            logits: Logits of the actions, shape (N, actions).
        """
        values = logits.astype(np.float64)
        below = np.logaddexp.accumulate(values, axis=1)[:, :-1]
        above = np.logaddexp.accumulate(values[:, ::-1], axis=1)[:, ::-1][:, 1:]
        return below - above

    def evidence(
        self, odds: np.ndarray, margin: float = 0.0, driver_brakes: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the `Evidence` of log odds, int64, shape (N,), and whether it is far from every threshold.

        Args:
            odds: Log odds, see `odds`.
            margin: Added to the thresholds of all stages but those of 50, which are never reached.
            driver_brakes: Whether the driver brakes, bool, shape (N,); None for no.
        """
        limits, thresholds = _thresholds(self)
        distance = odds[:, limits] - (thresholds + margin)
        if driver_brakes is not None:
            distance[:, _BRAKING.start :] -= self.driver_odds * driver_brakes[:, None]
        met = distance > 0.0
        met[:, _BRAKING] &= met[:, -1:]
        evidence = np.maximum.reduce(met[:, :-1] * _STAGES, axis=1)  # CLEAR is 0
        return evidence, np.logical_and.reduce(np.abs(distance) > SAFE_DISTANCE, axis=1)


_STAGES = np.array([Evidence.PRESENT, Evidence.WARNING, Evidence.PARTIAL, Evidence.FULL], np.int64)
_BRAKING = slice(2, 4)  # those that `confirm_odds`, which comes behind them, and `driver_odds` are for


@lru_cache(maxsize=64)  # a search for thresholds makes thousands of records
def _thresholds(params: TimeToBrakeParams) -> tuple[np.ndarray, np.ndarray]:
    """Return the index of the limit of each stage and of the confirmation, int64, and its log odds, float64.

    Those for never and always are infinite.
    """
    names = [Evidence(stage).name.lower() for stage in _STAGES]
    odds: list[float] = [*(getattr(params, f"{name}_odds") for name in names), params.confirm_odds]
    times = [*(getattr(params, f"{name}_s") for name in names), params.present_s]
    limits = [params.limits_s.index(time) for time in times]
    return np.array(limits), np.array([item * inf if abs(item) == MAX_ODDS else item for item in odds])
