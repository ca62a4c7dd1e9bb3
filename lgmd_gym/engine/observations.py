"""Observations: the batched observations of a simulation."""

from math import pi
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import create_empty_array

from lgmd_gym.engine.simulation import Simulation
from lgmd_gym.sensing.spaces import SIGNALS


class Observations:
    """Batched observations, written into the arrays of the observation space.

    Args:
        simulation: The environments.
        space: Observation space of one environment.
        include_frame: Whether to include the frames.
        include_base: Whether to include the observation of `BrakingEnv`.
        copy: Whether every call of `read` returns new arrays.
    """

    def __init__(
        self, simulation: Simulation, space: spaces.Space, include_frame: bool, include_base: bool, copy: bool
    ) -> None:
        self._simulation, self._space, self._copy = simulation, space, copy
        self._include_frame, self._include_base = include_frame, include_base
        self._arrays: Any = self._empty()

    def read(self, copy: bool = False) -> Any:
        """Return the present observations, in new arrays with `copy`."""
        arrays: Any = self._empty() if copy or self._copy else self._arrays
        sensors, state = self._simulation.sensors, self._simulation.state
        egos = state.bodies[:, 0]
        if sensors is None:
            return self._base(arrays)
        for name in SIGNALS:
            arrays[name][:] = getattr(sensors.responses, name)
        arrays["ego_speed"][:, 0] = egos["speed"]
        arrays["ego_yaw_rate"][:, 0] = self._yaw_rates(egos["heading"])
        if sensors.known_decelerations is not None:
            arrays["known_deceleration"][:] = sensors.known_decelerations
        if "column_potential" in arrays:
            arrays["column_potential"][:] = sensors.column_potentials()
        if self._include_frame:
            np.copyto(arrays["frame"], sensors.stacked_frames().transpose(0, 2, 3, 1))
        if self._include_base:
            self._base(arrays["base"])
        return arrays

    def _base(self, out: np.ndarray) -> np.ndarray:
        egos = self._simulation.state.bodies[:, 0]
        out[:, 0], out[:, 1] = egos["speed"], egos["acceleration"]
        out[:, 2] = self._simulation.state.egos["yaw_rate"]
        return out

    def _yaw_rates(self, headings: np.ndarray) -> np.ndarray:
        """Return the mean yaw rates of the decision by the shorter turn [rad/s]."""
        rates = self._simulation.rates
        turned = (headings - self._simulation.clock.headings + pi) % (2 * pi) - pi
        return turned / (rates.steps / rates.simulation)

    def _empty(self) -> Any:
        return create_empty_array(self._space, self._simulation.num_envs, fn=np.zeros)
