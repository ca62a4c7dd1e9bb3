"""Clutter: densities of what stands along a road."""

from dataclasses import dataclass, fields

import numpy as np

from lgmd_gym.errors import check_within

MAX_DENSITY = 200.0
"""Maximum density of one kind [1/km]."""


@dataclass(frozen=True)
class Clutter:
    """Densities of the pieces of clutter along a road, 0 to 200 [1/km].

    Raises:
        ValueError: For a density out of range.
    """

    sign: float = 0.0  # traffic signs, per outer edge
    board: float = 0.0  # direction signs on two posts, per outer edge
    lamp_post: float = 0.0  # lamp posts with an arm towards the road, per outer edge
    power_pole: float = 0.0  # power poles, per outer edge
    overhanging_tree: float = 0.0  # trees with a crown that reaches over the road, per outer edge
    thicket: float = 0.0  # dense trees and bushes of 24 m, per outer edge
    avenue: float = 0.0  # rows of four trees, per outer edge
    wall: float = 0.0  # walls of 30 m, per outer edge
    hedge: float = 0.0  # hedges of 10 m, per outer edge
    house: float = 0.0  # houses, per outer edge
    parked_car: float = 0.0  # parked vehicles, per outer edge
    bollard: float = 0.0  # bollards, per outer edge
    drain: float = 0.0  # drains at the edge of the asphalt, per outer edge
    gantry: float = 0.0  # gantries with one to three panels, per road
    bridge: float = 0.0  # bridges over the road, per road
    tunnel: float = 0.0  # underpasses of 30 to 60 m, per road
    signal: float = 0.0  # traffic signals with an arm over the road, per road
    zebra: float = 0.0  # zebra crossings, per road
    arrow: float = 0.0  # arrows on the asphalt, per lane
    patch: float = 0.0  # dark and light patches of tar, per lane
    manhole: float = 0.0  # manholes, per lane
    joint: float = 0.0  # joints across the lane, per lane
    skid: float = 0.0  # pairs of skid marks, per lane
    queue: float = 0.0  # queues of standing cars, per km of the lane that `place_clutter` is given

    def __post_init__(self) -> None:
        for field in fields(self):
            value = check_within(f"clutter {field.name}", getattr(self, field.name), 0.0, MAX_DENSITY, "1/km")
            object.__setattr__(self, field.name, value)


ROAD_TYPES = {
    "motorway": Clutter(
        sign=3.0, board=1.5, lamp_post=8.0, thicket=12.0, wall=5.0, gantry=0.8, bridge=0.7, tunnel=0.1,
        patch=6.0, joint=8.0, skid=3.0, queue=1.5,
    ),
    "rural": Clutter(
        sign=3.0, board=0.7, power_pole=8.0, overhanging_tree=5.0, thicket=20.0, avenue=8.0, hedge=5.0,
        house=1.5, bollard=2.0, bridge=0.3, patch=10.0, joint=2.0, skid=2.0, queue=0.5,
    ),
    "urban": Clutter(
        sign=3.5, lamp_post=20.0, overhanging_tree=2.0, thicket=4.0, avenue=6.0, wall=1.0, hedge=1.5,
        house=8.0, parked_car=9.0, bollard=1.0, drain=8.0, bridge=0.3, tunnel=0.2, signal=1.5, zebra=1.0,
        arrow=1.5, patch=8.0, manhole=8.0, joint=3.0, skid=1.0, queue=3.0,
    ),
    "industrial": Clutter(
        sign=3.0, board=1.0, lamp_post=16.0, power_pole=3.0, thicket=6.0, avenue=3.0, wall=5.0, hedge=1.5,
        house=4.0, parked_car=5.0, gantry=0.5, bridge=0.6, tunnel=0.2, signal=0.8, drain=4.0, patch=10.0,
        manhole=5.0, joint=6.0, skid=3.0, queue=1.5,
    ),
}  # fmt: skip
"""Typical densities by type of road."""

_PRESENT = 0.75  # probability that a kind of a road type occurs in a world


def draw_clutter(rng: np.random.Generator) -> Clutter:
    """Draw a type of road and the densities of its clutter.

    Each kind of the type is absent with a probability of 1/4, or has 0.4 to 1.6 times its typical density.
    """
    typical = ROAD_TYPES[list(ROAD_TYPES)[rng.integers(len(ROAD_TYPES))]]
    names = [field.name for field in fields(Clutter)]
    factors = rng.uniform(0.4, 1.6, len(names)) * (rng.random(len(names)) < _PRESENT)
    return Clutter(**{n: getattr(typical, n) * float(f) for n, f in zip(names, factors, strict=True)})
