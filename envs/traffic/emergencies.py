# pyright: standard
# Not strict: highway-env states few types.
"""Emergencies in traffic: when the ego needs a braking that its driver alone does not provide in time.

An emergency is a contact of the ego, on any side, or a moment in which the required deceleration reaches
`EMERGENCY`, the least emergency braking of UN R152 (5.2.1.2). The required deceleration is a generalised DRAC
(Cooper and Ferguson 1976), see `required_deceleration`. It depends on speeds, distances and steering only: a
driver of IDM also brakes by more than 5 m/s² to give way, without a conflict.

`EMERGENCY_SHARE` scales this to the brake of an episode: 5 m/s² of the default brake's 9 m/s². On a wet road
with 6 m/s², where a driver must brake earlier, the required deceleration of an emergency is 3.3 m/s².

A brake of the agent is needed if, without it, an emergency follows within `HORIZON`: 3 s is the limit of the
time to collision below which driving is critical (Minderhoud and Bovy 2001). The episode is therefore
continued from that moment with the driver alone.
"""

from bisect import bisect_left
from dataclasses import dataclass
from math import inf

from lgmd_gym.envs.dynamics.brake import EMERGENCY, BrakeParams
from lgmd_gym.envs.traffic.env import TrafficEnv

HORIZON = 3.0  # [s], a brake is needed if an emergency follows within this time
EMERGENCY_SHARE = EMERGENCY / BrakeParams().max_deceleration  # the same, as a share of full braking


def scaled_emergency(brake: BrakeParams) -> float:
    """Return the required deceleration of an emergency, scaled to a brake [m/s²]."""
    return EMERGENCY_SHARE * brake.max_deceleration


@dataclass(frozen=True, slots=True)
class Emergencies:
    """The emergencies of an episode without braking by the agent."""

    contact: float | None  # time of the ego's contact [s]; None without contact
    # times of decisions with a required deceleration of an emergency, ascending [s]
    demanding: tuple[float, ...]

    def time_until(self, time: float, horizon: float = HORIZON) -> float | None:
        """Return the time from `time` to the next emergency, 0 during one [s]; None beyond `horizon`."""
        tolerance = 1e-9
        number = bisect_left(self.demanding, time - tolerance)
        following = self.demanding[number] if number < len(self.demanding) else inf
        if self.contact is not None and self.contact >= time - tolerance:
            following = min(following, self.contact)
        return max(following - time, 0.0) if following - time <= horizon + tolerance else None


def simulate_driver(
    env: TrafficEnv, time: float, horizon: float = HORIZON, threshold: float = EMERGENCY
) -> Emergencies:
    """Continue an episode without the agent, even past its end, and return the emergencies.

    Args:
        env: The environment, left in the final state and with its road-step callback removed.
        time: Current time [s].
        horizon: Simulated time [s].
        threshold: Required deceleration of an emergency [m/s²].
    """
    vars(env.road).pop("step", None)  # the callback of `on_road_step` would render camera frames
    policy_hz = env.config["policy_frequency"]
    demanding = [time] if env.required_deceleration >= threshold else []
    for step in range(1, round(horizon * policy_hz) + 1):
        if env.road.contact is not None:
            return Emergencies(time + (step - 1) / policy_hz, tuple(demanding))
        env.step_unobserved()
        if env.required_deceleration >= threshold:
            demanding.append(time + step / policy_hz)
    return Emergencies(time + horizon if env.road.contact is not None else None, tuple(demanding))
