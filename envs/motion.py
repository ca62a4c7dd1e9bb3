# pyright: standard
# Not strict: highway-env states few types.
"""Motion of a scenario whose ego does not brake, for figures and checks."""

from dataclasses import dataclass

import numpy as np
from highway_env.road.road import RoadNetwork

from lgmd_gym.camera.worlds import LABORATORY
from lgmd_gym.envs.braking import BrakingEnv
from lgmd_gym.envs.families.scenario import Actor, Scenario
from lgmd_gym.envs.registration import SCENARIO, SCENARIO_ARGUMENT, make_source

_NO_DEMAND = np.zeros(1, np.float32)
_TALL_M, _LONG_M = 2.2, 7.5  # a taller or longer car is a truck, as `camera.objects` draws it


@dataclass(frozen=True, slots=True)
class Motion:
    """Positions and speeds of the ego and all actors; the ego is the first body."""

    scenario: Scenario
    times: np.ndarray  # time after the start, float64, shape (T,) [s]
    # centres in highway-env's axes, x along the ego's first heading and y to its right, relative to the ego's
    # first position, float64, shape (T, bodies, 2) [m]
    positions: np.ndarray
    headings: np.ndarray  # headings, + right, float64, shape (T, bodies) [rad]
    speeds: np.ndarray  # speeds, float64, shape (T, bodies) [m/s]
    sizes: np.ndarray  # length and width of every body, float64, shape (bodies, 2) [m]
    contact: bool  # whether the last time is that of a contact of the ego
    network: RoadNetwork  # lanes, in highway-env's own position
    origin: np.ndarray  # ego's first position there, float64, shape (2,) [m]

    @property
    def names(self) -> list[str]:
        """A name for every body, such as "1: car" or "2: truck", with the number of its actor."""
        actors = enumerate(self.scenario.actors, start=1)
        kinds = ((number, "truck" if is_truck(actor) else actor.kind) for number, actor in actors)
        return ["ego", *(f"{number}: {kind.replace('_', ' ')}" for number, kind in kinds)]


def is_truck(actor: Actor) -> bool:
    """Return whether an actor is a car of the size of a truck, which has no kind of its own."""
    return actor.kind == "car" and (actor.height > _TALL_M or actor.length > _LONG_M)


def record_motion(scenario: Scenario) -> Motion:
    """Return the motion of a scenario without braking, 30 times per second up to the end of the episode."""
    source = make_source(SCENARIO, {SCENARIO_ARGUMENT: scenario, "world": LABORATORY})
    env = BrakingEnv(source)
    _, info = env.reset(seed=0)
    origin = np.array(env.road.ego.position, np.float64)
    rows, done = list[list[tuple[float, ...]]](), False
    while True:
        rows.append([(*(item.position - origin), item.heading, item.speed) for item in env.road.items])
        if done:
            break
        _, _, terminated, truncated, info = env.step(_NO_DEMAND)
        done = terminated or truncated
    values = np.array(rows, np.float64)
    return Motion(
        scenario=scenario,
        times=np.arange(len(values)) / env.config["policy_frequency"],
        positions=values[..., :2],
        headings=values[..., 2],
        speeds=values[..., 3],
        sizes=np.array([(item.LENGTH, item.WIDTH) for item in env.road.items]),
        contact=bool(info["collision"]),
        network=env.road.network,
        origin=origin,
    )
