"""Emergencies in traffic: contacts of the ego and hard braking of its driver."""

from dataclasses import dataclass

from lgmd_gym.envs.traffic.env import TrafficEnv

HORIZON = 10.0  # [s], an emergency within this time after a brake makes it necessary; horizon of `ttc`
HARD_BRAKING = 5.0  # [m/s²], UN R152 2.1: minimum deceleration of an emergency braking demand


@dataclass(frozen=True, slots=True)
class Emergencies:
    """The emergencies of an episode without braking by the agent.

    An emergency is a contact of the ego, on any side, or braking of the driver by `HARD_BRAKING` or more. A
    brake of the agent before an emergency is necessary even if the driver alone would have avoided contact.

    Attributes:
        contact: Time of the ego's contact [s]; None without contact.
        hard: Times of the decisions after which the driver braked hard, ascending [s].
    """

    contact: float | None
    hard: tuple[float, ...]

    def time_until(self, time: float, horizon: float = HORIZON) -> float | None:
        """Return the time from `time` to the next emergency, 0 during one [s]; None beyond `horizon`."""
        times = [*self.hard, *([] if self.contact is None else [self.contact])]
        after = [moment - time for moment in times if -1e-9 <= moment - time <= horizon + 1e-9]
        return max(min(after), 0.0) if after else None


def simulate_driver(env: TrafficEnv, time: float, horizon: float = HORIZON) -> Emergencies:
    """Continue an episode without the agent, even past its end, and return the emergencies.

    Args:
        env: The environment, left in the final state and with its road-step callback removed.
        time: Current time [s].
        horizon: Simulated time [s].
    """
    vars(env.road).pop("step", None)  # the callback of `on_road_step` would render camera frames
    policy_hz = env.config["policy_frequency"]
    hard = [time] if env.ego.driver_acceleration <= -HARD_BRAKING else []
    for step in range(1, round(horizon * policy_hz) + 1):
        if env.road.contact is not None:
            return Emergencies(time + (step - 1) / policy_hz, tuple(hard))
        env.step_unobserved()
        if env.ego.driver_acceleration <= -HARD_BRAKING:
            hard.append(time + step / policy_hz)
    return Emergencies(time + horizon if env.road.contact is not None else None, tuple(hard))
