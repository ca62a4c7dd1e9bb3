"""What counts as an emergency in traffic, and whether one is coming."""

from dataclasses import dataclass

from lgmd_gym.envs.traffic.env import TrafficEnv

HORIZON = 10.0  # [s] after a brake within which an emergency makes it needed; the horizon of `ttc`
HARD = 5.0  # [m/s²], UN R152 2.1: an emergency braking demand is for 5.0 m/s² at least


@dataclass(frozen=True, slots=True)
class Emergencies:
    """The emergencies of a drive in which nobody brakes but the driver.

    An emergency is the ego's contact, with whatever part of it, or the driver himself braking by `HARD` or
    more: whoever brakes then brakes with good reason, even if the driver alone would have managed.

    Attributes:
        contact: Time of the ego's contact [s]; None without one.
        hard: Times of the decisions after which the driver braked hard [s], ascending.
    """

    contact: float | None
    hard: tuple[float, ...]

    def need(self, time: float, horizon: float = HORIZON) -> float | None:
        """Return how long after `time` [s] the next emergency is, 0 if it is one; None beyond `horizon`."""
        times = [*self.hard, *([] if self.contact is None else [self.contact])]
        after = [moment - time for moment in times if -1e-9 <= moment - time <= horizon + 1e-9]
        return max(min(after), 0.0) if after else None


def drive_on(env: TrafficEnv, time: float, horizon: float = HORIZON) -> Emergencies:
    """Let the driver go on alone, even beyond the drive's end, and return the emergencies that come.

    Args:
        env: Is left wherever that leads, and its road unwatched.
        time: At present [s].
        horizon: For how long [s].
    """
    vars(env.road).pop("step", None)  # an eye would go on looking
    policy_hz = env.config["policy_frequency"]
    hard = [time] if env.ego.driver <= -HARD else []
    for step in range(1, round(horizon * policy_hz) + 1):
        if env.road.touch is not None:
            return Emergencies(time + (step - 1) / policy_hz, tuple(hard))
        env.coast()
        if env.ego.driver <= -HARD:
            hard.append(time + step / policy_hz)
    return Emergencies(time + horizon if env.road.touch is not None else None, tuple(hard))
