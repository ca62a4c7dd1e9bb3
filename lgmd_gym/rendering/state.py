"""What the lamps and bars of the composed picture show, for our environments and highway-env's own."""

from dataclasses import dataclass
from math import inf
from typing import Any

BRAKES = 0.1  # [m/s²] of deceleration from which the brake lamp is lit


@dataclass(frozen=True, slots=True)
class Moment:
    """The state of a drive after a decision; SI units, inf where undefined.

    Attributes:
        time: Since the reset [s].
        speed: Of the ego [m/s].
        gap: Free distance along the ego's path [m].
        ttc: Time to contact [s].
        deceleration: Of the ego; in our environments what is beyond its script, >= 0 [m/s²].
        alert: Whether the neuron, or the agent if it told, warns.
        contact: Whether the ego has touched anybody.
        impact_speed: Relative, at the touch [m/s].
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
        return self.deceleration > BRAKES

    @classmethod
    def of(cls, host: Any, info: dict[str, Any], alert: bool | None = None) -> "Moment":
        """Return the present moment.

        Args:
            host: The highway-env environment itself.
            info: Of its last step; what highway-env's own environments do not tell stays undefined.
            alert: What the agent says; None for the neuron's alert.
        """
        ego = host.vehicle
        action = getattr(ego, "action", None) or {}
        return cls(
            time=float(host.time),
            speed=float(info.get("ego_speed", ego.speed)),
            gap=float(info.get("gap", inf)),
            ttc=float(info.get("ttc", inf)),
            deceleration=float(info.get("deceleration", max(0.0, -float(action.get("acceleration", 0.0))))),
            alert=bool(info.get("lgmd/alert", False)) if alert is None else alert,
            contact=bool(info.get("collision", ego.crashed)),
            impact_speed=float(info.get("relative_impact_speed", inf)),
        )
