"""DisplayState: the quantities that the lamps and bars of the dashboard show."""

from dataclasses import dataclass
from math import inf
from typing import Any

BRAKING_THRESHOLD = 0.1  # [m/s²], deceleration above which the brake lamp is lit


@dataclass(frozen=True, slots=True)
class DisplayState:
    """State of an episode after a decision; undefined values are infinite.

    Attributes:
        time: Time since the reset [s].
        speed: Ego speed [m/s].
        gap: Free distance along the ego's path [m].
        ttc: Time to contact [s].
        deceleration: Ego deceleration, >= 0 [m/s²]; in environments of this package, only the part beyond
            the script.
        alert: Whether the neuron, or the agent if it reports alerts, is in alert.
        contact: Whether the ego has had contact.
        impact_speed: Relative speed at contact [m/s].
    """

    time: float
    speed: float
    gap: float = inf
    ttc: float = inf
    deceleration: float = 0.0
    alert: bool = False
    contact: bool = False
    impact_speed: float = inf

    @property
    def braking(self) -> bool:
        """Whether the ego brakes."""
        return self.deceleration > BRAKING_THRESHOLD

    @classmethod
    def from_info(cls, env: Any, info: dict[str, Any], alert: bool | None = None) -> "DisplayState":
        """Return the current state.

        Args:
            env: The unwrapped highway-env environment.
            info: Info of its last step. Quantities that it lacks, as in stock highway-env environments, are
                taken from the vehicle or stay undefined.
            alert: Alert of the agent; None for that of the neuron.
        """
        ego = env.vehicle
        action = getattr(ego, "action", None) or {}
        return cls(
            time=float(env.time),
            speed=float(info.get("ego_speed", ego.speed)),
            gap=float(info.get("gap", inf)),
            ttc=float(info.get("ttc", inf)),
            deceleration=float(info.get("deceleration", max(0.0, -float(action.get("acceleration", 0.0))))),
            alert=bool(info.get("lgmd/alert", False)) if alert is None else alert,
            contact=bool(info.get("collision", ego.crashed)),
            impact_speed=float(info.get("relative_impact_speed", inf)),
        )
