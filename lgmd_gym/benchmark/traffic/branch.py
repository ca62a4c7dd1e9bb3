# pyright: standard
# Not strict: highway-env states few types.
"""The drive without the agent from some decision on, and what full braking could do in it."""

import copy
from collections.abc import Callable

from lgmd_gym.agents import BRAKE, HOLD, to_action
from lgmd_gym.envs.traffic.emergencies import Emergencies
from lgmd_gym.envs.traffic.env import TrafficEnv


class Branch:
    """A drive in which the driver alone acts, simulated as far as it is needed, even past the episode's end.

    Args:
        start: Number of the first given decision.
        speeds: Ego speed at the given decisions [m/s].
        required: Required deceleration at the given decisions [m/s²].
        contact: Whether the ego has contact at the last one.
        make_env: Returns the environment in the state of the last one; it is stepped here.
        policy_hz: Decision rate [Hz].
    """

    def __init__(
        self,
        start: int,
        speeds: list[float],
        required: list[float],
        contact: bool,
        make_env: Callable[[], TrafficEnv],
        policy_hz: float,
    ) -> None:
        self._start, self._speeds, self._required = start, speeds, required
        self._contact = self._last if contact else None
        self._make_env, self._env, self._hz = make_env, None, policy_hz

    @property
    def _last(self) -> int:
        """Number of the last known decision."""
        return self._start + len(self._speeds) - 1

    def _simulate(self, decision: int) -> None:
        """Simulate up to a decision, or to the contact."""
        while self._last < decision and self._contact is None:
            if self._env is None:
                self._env = self._make_env()
            self._env.step_unobserved()
            self._speeds.append(float(self._env.ego.speed))
            self._required.append(self._env.required_deceleration)
            if self._env.road.contact is not None:
                self._contact = self._last

    def speed(self, decision: int) -> float:
        """Return the ego speed at a decision; after a contact that of the contact [m/s]."""
        self._simulate(decision)
        return self._speeds[min(decision, self._last) - self._start]

    def contact(self, decision: int) -> int | None:
        """Return the decision of the ego's contact up to a decision; None without one."""
        self._simulate(decision)
        return self._contact if self._contact is not None and self._contact <= decision else None

    def emergencies(self, decision: int, threshold: float) -> Emergencies:
        """Return the emergencies up to a decision.

        Args:
            decision: Number of the last decision.
            threshold: Required deceleration of an emergency [m/s²].
        """
        contact = self.contact(decision)
        required = self._required[: max(decision - self._start + 1, 0)]
        return Emergencies(
            None if contact is None else contact / self._hz,
            tuple((self._start + k) / self._hz for k, value in enumerate(required) if value >= threshold),
        )


def branch_from(env: TrafficEnv, decision: int) -> Branch:
    """Return the drive without the agent from the state of an environment on, which stays unchanged."""
    twin = fork(env)
    contact = env.road.contact is not None
    values = ([float(env.ego.speed)], [env.required_deceleration])
    return Branch(decision, *values, contact, lambda: twin, env.config["policy_frequency"])


def avoids(env: TrafficEnv, decisions: int, released: int | None = None) -> bool:
    """Return whether full braking from now on avoids a contact of the ego.

    Args:
        env: The environment; it is stepped.
        decisions: Number of simulated decisions.
        released: Number of decisions after which the brake is released; None for never.
    """
    env.action_type.act(to_action(BRAKE))
    for decision in range(decisions):
        if decision == released:
            env.action_type.act(to_action(HOLD))
        env.step_unobserved()
        if env.road.contact is not None:
            return False
    return True


def fork(env: TrafficEnv) -> TrafficEnv:
    """Return an independent copy of a traffic environment in the same state.

    The lanes are shared because they never change. The copy's road has no callback of `on_road_step`.
    """
    network = env.road.network
    callback = vars(env.road).pop("step", None)
    try:
        return copy.deepcopy(env, {id(item): item for item in (network, *network.lanes_list())})
    finally:
        if callback is not None:
            vars(env.road)["step"] = callback
