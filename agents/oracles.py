"""Oracles: agents on ground truth, as references without errors of perception."""

from dataclasses import asdict
from math import inf

import numpy as np

from lgmd_gym.agents.base import (
    FPS,
    Infos,
    LatchingAgent,
    Observations,
    StagedAgent,
    State,
)
from lgmd_gym.agents.stages import Evidence, StageParams
from lgmd_gym.agents.zones import CAMERA_SETBACK, FULL_DECELERATION, stopping_distance
from lgmd_gym.envs.forecast import ForecastParams
from lgmd_gym.errors import check_positive, check_whole

TARGET_WIDTH = 1.712  # ISO 19206-3 [m]; `info` has no width
DECISION_INTERVAL = 1 / FPS  # [s]
RELEASE = 2.0  # [s] for which braking must be able to wait after a release
# [s] before the last moment. A driver who brakes at 4 m/s², 1.2 s after the alert (Euro NCAP AEB C2C v4.3.1,
# 8.4.6), needs 2.7 s to a standing car at 80 km/h with a brake of 9 m/s².
WARNING = 3.0


class LastMomentOracle(StagedAgent):
    """Brakes fully at the last moment at which the episode's brake avoids the contact: a bound of agents.

    It reads the time to brake, which the engine decides by forks of the episode: what happens if the ego goes
    on, and if it brakes fully after any number of decisions, with the delay, build-up and strength of the
    episode's brake, see `lgmd_gym.envs.forecast`. It brakes when one more decision would be too late. A
    contact that no braking avoids makes it brake where waiting begins to raise the impact speed: at once, or,
    with oncoming cars, in time to stand still. It releases the brake when braking could wait for 2 s after
    the release. It warns 3 s before.

    It knows the present motion of others, their paths, and the rest of what they have begun, such as the
    deceleration of a lead car that brakes. With `foresight` it also knows what they will begin, and brakes
    before the lead car does where its brake needs that.

    Observes `info["ttb"]`, in an environment with the configuration `LastMomentOracle.config`.

    Args:
        share: Share of the full deceleration with which braking must avoid the contact, in (0, 1]. The
            deceleration that is required reaches this share when it brakes, and it brakes fully. With 1, the
            default, it brakes as late as possible: the forks are exact, so that a margin would avoid no more.
        foresight: 1 if it knows what others have not begun, else 0.
    """

    name = "last-moment-oracle"
    reads_neuron = False
    brake = StageParams(release_s=0.0, hold_speed=0.0)

    def __init__(self, share: float = 1.0, foresight: int = 0) -> None:
        params = ForecastParams(share=share, foresight=check_whole("foresight", foresight, 0, 1) == 1)
        self.config = {"forecast": asdict(params)}
        super().__init__()

    def evidence(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the evidence of the time to brake.

        Raises:
            ValueError: If the environment does not forecast the time to brake.
        """
        if "ttb" not in infos:
            raise ValueError(
                f"{self.name} requires info['ttb'], which traffic does not have; make the environment with "
                f"config={self.config}"
            )
        ttb = np.asarray(infos["ttb"], np.float64)
        braking = self.state["stage"] == Evidence.FULL
        kept = np.where(braking & (ttb < RELEASE), Evidence.PRESENT, Evidence.CLEAR)
        warned = np.where(~braking & (ttb < WARNING), Evidence.WARNING, kept)
        return np.where(ttb < DECISION_INTERVAL / 2, Evidence.FULL, warned)


class TTCOracle(StagedAgent):
    """Reads the true time to contact: warns when it falls to `alert`, brakes fully when it falls to `ttc`.

    Observes `info["ttc"]`.

    Args:
        ttc: Threshold, > 0 [s]. The default avoids all contacts of the protocol suites with the default
            brake, except with oncoming cars (CCFhos, CCFhol), which no braking avoids. The critical case is a
            lead car 40 m ahead that brakes at 0.5 g from 80 km/h, in which 1.8 s is too late.
        alert: Threshold of the warning, > 0 [s]. A driver who brakes at 4 m/s², 1.2 s after it (Euro NCAP AEB
            C2C v4.3.1, 8.4.6), needs 4.2 s to a standing car at 80 km/h.
    """

    name = "ttc-oracle"
    reads_neuron = False

    def __init__(self, ttc: float = 2.0, alert: float = 4.5) -> None:
        self.ttc, self.alert = check_positive("ttc", ttc), check_positive("alert", alert)
        super().__init__()

    def evidence(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return the evidence of the true time to contact; a brake latches."""
        ttc = np.asarray(infos["ttc"])
        warned = np.where(ttc <= self.alert, Evidence.WARNING, Evidence.PRESENT)
        return np.where(ttc <= self.ttc, Evidence.FULL, warned)


class StoppingDistanceOracle(LatchingAgent):
    """Brakes fully at the latest time at which the ego can stop behind the car ahead.

    Condition: gap ≤ d(v − w) + `margin`, with ego speed v, target speed w < v and the stopping distance
    d(u) = u² / (2 · `deceleration`) + u · `reaction`. If the target decelerates by a > 1 m/s², the right side
    is at least d(v) − w² / (2a) + `margin`; a is the difference of the last two target speeds. Only targets
    on the ego's path count, so that braking for crossing traffic begins late.

    Observes `info["gap"]`, `info["ego_speed"]`, `info["target_speed"]`.

    Args:
        deceleration: Deceleration of full braking, > 0 [m/s²].
        reaction: Time from the demand to full braking, > 0 [s].
        margin: Remaining distance to the target, > 0 [m].
    """

    name = "stopping-distance-oracle"
    reads_neuron = False

    def __init__(
        self, deceleration: float = FULL_DECELERATION, reaction: float = 0.4, margin: float = 1.5
    ) -> None:
        self.deceleration = check_positive("deceleration", deceleration)
        self.reaction = check_positive("reaction", reaction)
        self.margin = check_positive("margin", margin)
        super().__init__()

    def initial(self) -> State:
        """Return a released brake and no previous target speed."""
        return super().initial() | {"target_speed": inf}

    def brake_conditions(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return whether the gaps are at or below the required distances."""
        speed, target_speed, gap = _floats(infos, "ego_speed", "target_speed", "gap")
        previous, self.state["target_speed"] = self.state["target_speed"], target_speed
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):  # undefined values are inf
            deceleration = (previous - target_speed) / DECISION_INTERVAL
            closing = np.isfinite(gap) & np.isfinite(target_speed) & (speed > target_speed)
            required = stopping_distance(speed - target_speed, self.deceleration, self.reaction)
            ego_distance = stopping_distance(speed, self.deceleration, self.reaction)
            both_stop = np.maximum(required, ego_distance - target_speed**2 / (2 * deceleration))
            braking = (deceleration > 1.0) & (deceleration < inf)  # both cars come to a standstill
            return closing & (gap <= np.where(braking, both_stop, required) + self.margin)


def _floats(infos: Infos, *names: str) -> tuple[np.ndarray, ...]:
    """Return values of the infos, float64, shape (N,) each."""
    return tuple(np.asarray(infos[name], np.float64) for name in names)


def _visual_angle(infos: Infos) -> tuple[np.ndarray, np.ndarray]:
    """Return the targets' visual angles θ at the lens [rad] and θ′ [rad/s]; zeros without a target."""
    speed, target_speed, gap = _floats(infos, "ego_speed", "target_speed", "gap")
    known, half_width = np.isfinite(gap) & np.isfinite(target_speed), TARGET_WIDTH / 2
    distance = np.where(known, gap, 0.0) + CAMERA_SETBACK
    closing_speed = speed - np.where(known, target_speed, 0.0)
    theta = 2 * np.arctan2(half_width, distance)
    rate = 2 * half_width * closing_speed / np.hypot(distance, half_width) ** 2
    return np.where(known, theta, 0.0), np.where(known, rate, 0.0)


class EtaOracle(LatchingAgent):
    """Brakes fully when the looming model η = θ′ · e^(−αθ) reaches a threshold (Gabbiani et al.).

    θ is the true visual angle of the target on the ego's path. η peaks at the angular size 2·atan(1/α) for
    every approach speed, as the locust's DCMD neuron does.

    Observes `info["gap"]`, `info["ego_speed"]`, `info["target_speed"]`.

    Args:
        threshold: Threshold of η, > 0 [rad/s].
        alpha: Weight α of the size-dependent inhibition, > 0 [1/rad].
    """

    name = "eta-oracle"
    reads_neuron = False

    def __init__(self, threshold: float = 0.03, alpha: float = 2.0) -> None:
        self.threshold, self.alpha = check_positive("threshold", threshold), check_positive("alpha", alpha)
        super().__init__()

    def brake_conditions(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return whether η is at or above the threshold."""
        theta, rate = _visual_angle(infos)
        return rate * np.exp(-self.alpha * theta) >= self.threshold


class TauOracle(LatchingAgent):
    """Brakes fully when the optical time to contact τ = θ/θ′ (Lee) falls to a threshold: τ ≤ `tau`.

    θ is the true visual angle of the target on the ego's path.

    Observes `info["gap"]`, `info["ego_speed"]`, `info["target_speed"]`.

    Args:
        tau: Threshold, > 0 [s].
    """

    name = "tau-oracle"
    reads_neuron = False

    def __init__(self, tau: float = 1.8) -> None:
        self.tau = check_positive("tau", tau)
        super().__init__()

    def brake_conditions(self, observations: Observations, infos: Infos, active: np.ndarray) -> np.ndarray:
        """Return whether τ is at or below the threshold; False unless θ grows."""
        theta, rate = _visual_angle(infos)
        grows = rate > 0.0
        return grows & (theta / np.where(grows, rate, 1.0) <= self.tau)
