"""The road of a braking scenario: contact with the ego is found inside the step."""

from collections.abc import Sequence
from math import cos
from typing import Any, NamedTuple

import numpy as np
from highway_env.road.road import Road, RoadNetwork

from lgmd_gym.envs.dynamics.contact import first_touch
from lgmd_gym.envs.simulation.vehicles import Box, EgoCar, Follower, RoadMarking, ScriptedCar


class Contact(NamedTuple):
    """The ego's first touch of somebody or something.

    Attributes:
        other: What was hit.
        impact_speed: The ego's speed at the touch [m/s].
        relative_impact_speed: The ego's speed less the other's along the ego's heading [m/s].
    """

    other: Any
    impact_speed: float
    relative_impact_speed: float


class BrakingRoad(Road):
    """A road that sweeps the ego's rectangle through each step.

    Attributes:
        ego: The car under test.
        contact: The first contact, or None so far. From then on the road stands still: the cars stay where
            they touched, with the speeds of that moment.
    """

    def __init__(self, network: RoadNetwork, np_random: np.random.Generator) -> None:
        super().__init__(network=network, np_random=np_random)  # type: ignore[arg-type]
        self.ego: EgoCar | None = None
        self.contact: Contact | None = None

    def add(self, item: ScriptedCar | Box | RoadMarking) -> None:
        """Put somebody or something on the road."""
        (self.vehicles if isinstance(item, ScriptedCar) else self.objects).append(item)  # type: ignore[arg-type]

    @property
    def obstacles(self) -> list[Any]:
        """Everybody and everything that the ego can touch."""
        everything: Sequence[Any] = [*self.vehicles, *self.objects]
        return [
            item
            for item in everything
            if isinstance(item, Follower) and item is not self.ego and not isinstance(item, RoadMarking)
        ]

    def step(self, dt: float) -> None:
        """Advance everybody by `dt` [s], or up to the first contact of the ego within it."""
        ego = self.ego
        if self.contact is not None or ego is None:
            return
        others = self.obstacles
        before = [(item.along, item.speed, item.rectangle) for item in (ego, *others)]
        super().step(dt)
        for item in self.objects:
            if isinstance(item, Box | RoadMarking):
                item.step(dt)
        hit = _first_hit([ego, *others], before)
        if hit is None:
            return
        fraction, other = hit
        for item, (along, speed, _) in zip((ego, *others), before, strict=True):
            item.move((1.0 - fraction) * (along - item.along))
            item.speed = (1.0 - fraction) * speed + fraction * item.speed
        across = other.speed * cos(float(other.heading) - float(ego.heading))
        self.contact = Contact(other, float(ego.speed), float(ego.speed) - across)
        ego.crashed = other.crashed = True


def _first_hit(items: list[Any], before: list[Any]) -> tuple[float, Any] | None:
    """Return the fraction of the step at which the first of `items` touches another, and that one."""
    start, end = before[0][2], items[0].rectangle
    ego_dx, ego_dy = end.x - start.x, end.y - start.y
    found: tuple[float, Any] | None = None
    for other, (_, _, outline) in zip(items[1:], before[1:], strict=True):
        now = other.rectangle
        dx, dy = ego_dx - (now.x - outline.x), ego_dy - (now.y - outline.y)
        fraction = first_touch(start, outline, dx, dy)
        if fraction is not None and (found is None or fraction < found[0]):
            found = fraction, other
    return found
