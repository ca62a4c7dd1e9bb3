"""TopViews: highway-env's top view of the environments of a simulation."""

from typing import Any

import numpy as np

from lgmd_gym.engine.episodes import Prepared
from lgmd_gym.engine.simulation import Simulation
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.episode_source import FixedScenario
from lgmd_gym.envs.highway.road import BrakingRoad


class TopViews:
    """Renders environments of a simulation as `BrakingEnv.render` does.

    Args:
        simulation: The environments.
        config: Configuration of the environments.
    """

    def __init__(self, simulation: Simulation, config: dict[str, Any]) -> None:
        self._simulation, self._config = simulation, config
        self._viewers: dict[int, BrakingEnv] = {}

    def render(self, index: int, prepared: Prepared) -> np.ndarray:
        """Return the top view of environment `index`, uint8, shape (height, width, 3)."""
        if index not in self._viewers:
            source = FixedScenario(prepared.draw.placement.scenario)
            self._viewers[index] = BrakingEnv(source, config=self._config, render_mode="rgb_array")
        viewer, simulation = self._viewers[index], self._simulation
        physics, demands = simulation.physics, simulation.clock.demands
        viewer.road = BrakingRoad(prepared.network, prepared.generator, physics, demands, index)
        viewer.controlled_vehicles = [viewer.road.ego]
        frame = viewer.render()
        assert frame is not None
        return frame

    def close(self) -> None:
        """Close the viewers."""
        for viewer in self._viewers.values():
            viewer.close()
        self._viewers.clear()
