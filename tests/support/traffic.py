"""Traffic environments and helpers shared by test files."""

import numpy as np

from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.batch import IN_LABORATORY
from lgmd_gym.benchmark.traffic.observer import Observer
from lgmd_gym.benchmark.traffic.recording import record_traffic
from lgmd_gym.benchmark.traffic.replay import Replay
from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.traffic.cars import TrafficCar
from lgmd_gym.envs.traffic.kinds import HighwayTraffic

HOLD, BRAKE = np.array([0.0], np.float32), np.array([-1.0], np.float32)


class EmptyHighway(HighwayTraffic):
    """A highway without other cars, or with one stationary car at a distance [m] between centres."""

    appearance = IN_LABORATORY
    stationary_car_at: float | None = None
    warm_up = 0.0

    def _modify_scene(self):
        road = self.road
        road.vehicles[:] = [self.ego]
        if self.stationary_car_at is not None:
            position = self.ego.position + np.array([self.stationary_car_at, 0.0])
            road.vehicles.append(TrafficCar(road, position, speed=0.0))
            road.vehicles[-1].crashed = True


class BlockedHighway(EmptyHighway):
    """A highway with a stationary car 50 m ahead."""

    stationary_car_at = 50.0


def run_for(env, seconds, action=HOLD):
    """Return the infos of an episode that repeats one action, up to its end or a time limit [s]."""
    infos = []
    for _ in range(round(seconds * 30)):
        _, _, terminated, truncated, info = env.step(action)
        infos.append(info)
        if terminated or truncated:
            break
    return infos


class Recorded:
    """A recording of traffic with the steps that an agent with all cameras receives.

    Attributes:
        recording: The recording.
        steps: Steps of all decisions.
    """

    def __init__(self, kind, seed=0, sensor_config=None, config=None, appearance=IN_LABORATORY):
        self.sensor_config = sensor_config or SensorConfig()
        observer = Observer(self.sensor_config)
        self.recording = record_traffic(kind, seed, observer.sensors, 0, observer.fps, appearance, config)
        self.steps = [observer.observe([moment])[0] for moment in self.recording.moments]

    def replay(self, agent):
        """Return the replay of an agent, played to its end."""
        replay = Replay(self.recording, agent, self.sensor_config)
        for step in self.steps:
            if not replay.done:
                replay.process(step)
        return replay


def car_states(kinds=tuple(TRAFFIC_KINDS)):
    """Return positions and speeds of all cars after three seconds as strings in full precision."""
    lines = []
    for kind in kinds:
        env = make_traffic(kind, camera=None)
        env.reset(seed=5)
        run_for(env, 3)
        lines += [repr([kind, *car.position.tolist(), float(car.speed)]) for car in env.road.vehicles]
    return lines


if __name__ == "__main__":
    print(*car_states(), sep="\n")
