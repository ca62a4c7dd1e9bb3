"""EpisodeQueue: the next episode of every environment, drawn ahead if there are several threads."""

import copy
import os
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from gymnasium.utils import seeding
from highway_env.road.road import RoadNetwork

from lgmd_gym.aliases import Values
from lgmd_gym.camera.road_geometry import RoadGeometry
from lgmd_gym.camera.road_pool import scene_geometry
from lgmd_gym.envs.episode_source import Draw, EpisodeSource


class Prepared(NamedTuple):
    """An episode that is ready to be loaded."""

    draw: Draw  # the episode
    network: RoadNetwork  # its highway-env road network
    geometry: RoadGeometry | None  # what cameras draw of it, if it was drawn ahead
    generator: np.random.Generator  # the random generator after the draw


class EpisodeQueue:
    """Draws the episodes of N environments, each with its own random generator.

    The draws equal those of `BrakingEnv` with the same seeds.

    Args:
        sources: Source of every environment.
        ahead: Whether to draw the next episodes in a background thread while the present ones run.
        shown: Whether cameras draw the roads.

    Attributes:
        generators: Random generator of every environment; None before the first seed.
        seeds: The last seeds.
    """

    def __init__(self, sources: Sequence[EpisodeSource], ahead: bool, shown: bool) -> None:
        self.sources = list(sources)
        self.generators: list[np.random.Generator | None] = [None] * len(sources)
        self.seeds: list[int | None] = [None] * len(sources)
        self._ahead, self._shown = ahead, shown
        self._waiting: list[Future[Prepared] | None] = [None] * len(sources)
        self._worker: ThreadPoolExecutor | None = None
        self._pid = 0

    def seed(self, index: int, seed: int | None) -> None:
        """Seed the generator of an environment; None keeps it, or seeds a new one from the system."""
        if seed is not None or self.generators[index] is None:
            self.generators[index], self.seeds[index] = seeding.np_random(seed)
            self._waiting[index] = None

    def assign(self, index: int, source: EpisodeSource) -> None:
        """Draw the next episodes of an environment from another source; a waiting draw is dropped."""
        self.sources[index], self._waiting[index] = source, None

    def next(self, index: int) -> Prepared:
        """Return the next episode of a seeded environment."""
        waiting, self._waiting[index] = self._waiting[index], None
        generator = self.generators[index]
        assert generator is not None
        # The worker of a parent process does not exist after a fork; its draws are repeated.
        ready = waiting is not None and self._pid == os.getpid()
        prepared = waiting.result() if ready and waiting else _prepare(self.sources[index], generator, False)
        self.generators[index] = prepared.generator
        if self._ahead:
            # The worker draws from a copy, so that a new seed can replace the generator at any time.
            copied = copy.deepcopy(prepared.generator)
            self._waiting[index] = self._own_worker().submit(
                _prepare, self.sources[index], copied, self._shown
            )
        return prepared

    def close(self) -> None:
        """Stop the background thread."""
        if self._worker is not None and self._pid == os.getpid():
            self._worker.shutdown(cancel_futures=True)
        self._worker = None

    def __getstate__(self) -> Values:
        """Copies have no background thread, and repeat the draws that wait."""
        return self.__dict__ | {"_worker": None, "_waiting": [None] * len(self.sources)}

    def _own_worker(self) -> ThreadPoolExecutor:
        """Return the background thread of this process; a forked process has none of its parent's threads."""
        if self._worker is None or self._pid != os.getpid():
            self._worker = ThreadPoolExecutor(1, thread_name_prefix="episodes")
            self._pid = os.getpid()
        return self._worker


def _prepare(source: EpisodeSource, generator: np.random.Generator, shown: bool) -> Prepared:
    draw = source.draw(generator)
    network = draw.make_network()
    geometry = scene_geometry(network, draw.scene) if shown else None
    return Prepared(draw, network, geometry, generator)
