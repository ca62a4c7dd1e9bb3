"""The road of a braking scenario, with contact detection inside each step."""

from typing import Any

import numpy as np
from highway_env.road.road import Road, RoadNetwork

from lgmd_gym.envs.dynamics.contact import Contact, first_contact, outline
from lgmd_gym.envs.simulation.vehicles import Box, EgoCar, RoadMarking, ScriptedCar


class BrakingRoad(Road):
    """A road that finds the ego's first contact within each step.

    Attributes:
        ego: The car under test.
        contact: First contact of the ego, or None. After it the road does not advance: all vehicles keep the
            positions and speeds of that moment.
    """

    def __init__(self, network: RoadNetwork, np_random: np.random.Generator) -> None:
        super().__init__(network=network, np_random=np_random)  # type: ignore[arg-type]
        self.ego: EgoCar | None = None
        self.contact: Contact | None = None

    def add(self, item: ScriptedCar | Box | RoadMarking) -> None:
        """Add a vehicle or object to the road."""
        (self.vehicles if isinstance(item, ScriptedCar) else self.objects).append(item)  # type: ignore[arg-type]

    @property
    def obstacles(self) -> list[Any]:
        """Vehicles and solid objects that the ego can touch."""
        items: list[Any] = [*self.vehicles, *self.objects]
        return [item for item in items if isinstance(item, ScriptedCar | Box)]

    def step(self, dt: float) -> None:
        """Advance all vehicles and objects by `dt` [s], or up to the ego's first contact."""
        ego = self.ego
        if self.contact is not None or ego is None:
            return
        items = [ego, *self.obstacles]
        before = [outline(item) for item in items]
        motion = [(item.travelled, item.speed) for item in items]
        super().step(dt)
        for item in self.objects:
            if isinstance(item, Box | RoadMarking):
                item.step(dt)
        fraction, index = first_contact(before, [outline(item) for item in items])
        if index == 0:
            return
        for item, (travelled, speed) in zip(items, motion, strict=True):
            item.move((1.0 - fraction) * (travelled - item.travelled))
            item.speed = (1.0 - fraction) * speed + fraction * item.speed
        self.contact = Contact.between(ego, items[index])
        ego.crashed = items[index].crashed = True
