"""Traffic environments and helpers that several test files share."""

import numpy as np

from lgmd_gym.envs.traffic.drivers import TrafficCar
from lgmd_gym.envs.traffic.kinds import HighwayTraffic
from lgmd_gym.envs.traffic.registration import KINDS, make_traffic

HOLD, BRAKE = np.array([0.0], np.float32), np.array([-1.0], np.float32)
KIND_NAMES = list(KINDS)


class Wall(HighwayTraffic):
    """An empty road, with a car standing `ahead` metres ahead."""

    ahead: float | None = None
    warm_up = 0.0

    def _settle(self):
        road = self.road
        road.vehicles[:] = [self.ego]
        if self.ahead is not None:
            road.vehicles.append(TrafficCar(road, self.ego.position + np.array([self.ahead, 0.0]), speed=0.0))
            road.vehicles[-1].crashed = True


class NearWall(Wall):
    ahead = 50.0


def drive(env, seconds, action=HOLD):
    infos = []
    for _ in range(round(seconds * 30)):
        _, _, terminated, truncated, info = env.step(action)
        infos.append(info)
        if terminated or truncated:
            break
    return infos


def digest(kinds=KIND_NAMES):
    """Return where everybody is after three seconds, in full precision."""
    lines = []
    for kind in kinds:
        env = make_traffic(kind, camera=None)
        env.reset(seed=5)
        drive(env, 3)
        lines += [repr([kind, *car.position.tolist(), float(car.speed)]) for car in env.road.vehicles]
    return lines
