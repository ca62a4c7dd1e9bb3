"""Traffic environments and helpers shared by test files."""

import copy

import numpy as np

from lgmd_gym.agents.base import rows_of
from lgmd_gym.agents.user_agents import UserAgents
from lgmd_gym.benchmark.episode import Step
from lgmd_gym.benchmark.sensors import SensorConfig
from lgmd_gym.benchmark.traffic.batch import IN_LABORATORY
from lgmd_gym.benchmark.traffic.observer import Observer
from lgmd_gym.benchmark.traffic.player import AgentPlayer
from lgmd_gym.benchmark.traffic.recording import record_traffic
from lgmd_gym.benchmark.traffic.replay import Replay
from lgmd_gym.envs.attention import Attention
from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.traffic.cars import TrafficCar
from lgmd_gym.envs.traffic.driver_errors import DriverErrors, Window
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


def errors_of(glances=(), brakings=(), **fields):
    """Return errors of drivers with given windows."""
    errors = DriverErrors(Attention(**fields), np.random.default_rng(0), 60.0, 1 / 30)
    errors.glances = tuple(Window(*item) for item in glances)
    errors.brakings = tuple(Window(*item) for item in brakings)
    return errors


class Following(EmptyHighway):
    """The ego at 25 m/s follows a car of the same speed that is 30 m ahead, centre to centre.

    The car ahead brakes by 8 m/s² from 1.5 s to 4.5 s, and the driver looks away from 1 s to 5 s.
    """

    glances = ((1.0, 5.0),)
    brakings = ((1.5, 4.5, 8.0),)

    def _modify_scene(self):
        super()._modify_scene()
        self.lead = TrafficCar(self.road, self.ego.position + np.array([30.0, 0.0]), speed=25.0)
        self.lead.TIME_WANTED = self.ego.TIME_WANTED = 0.8
        self.road.vehicles.append(self.lead)

    def _reset(self):
        super()._reset()
        self.road.errors = errors_of(self.glances, self.brakings)


class Followed(EmptyHighway):
    """The ego is followed by a car whose driver reacts late.

    Attributes:
        ego_speed: Speed of the ego at the start [m/s].
        behind: Distance of the car behind, centre to centre [m].
        speed: Speed of the car behind [m/s].
        reaction_time: Reaction time of its driver [s].
    """

    ego_speed, behind, speed, reaction_time = 25.0, 14.0, 25.0, 1.25

    def _modify_scene(self):
        super()._modify_scene()
        self.ego.position, self.ego.speed = self.ego.position + np.array([100.0, 0.0]), self.ego_speed
        follower = TrafficCar(self.road, self.ego.position - np.array([self.behind, 0.0]), speed=self.speed)
        follower.TIME_WANTED, follower.enable_lane_change = 0.3, False
        self.road.vehicles.append(follower)

    def _reset(self):
        super()._reset()
        self.road.errors = errors_of(reaction_time=self.reaction_time)


class Standing(Followed):
    """The ego stands for the whole episode, and the car behind does not brake in time."""

    ego_speed, behind, speed, reaction_time = 0.0, 50.0, 20.0, 5.0

    def _modify_scene(self):
        super()._modify_scene()
        self.ego.target_speed = 0.0


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
        self.observed = [copy.deepcopy(observer.observe([moment])) for moment in self.recording.moments]
        self.steps = [step_of(observed) for observed in self.observed]

    def replay(self, agent):
        """Return the replay of an agent for a single environment, played to its end."""
        replay, player = Replay(self.recording), AgentPlayer(UserAgents("test", lambda: agent), 1)
        for observed in self.observed:
            for error in player.process(observed, [replay]).values():
                raise error
            if replay.needs_env:
                player.play_alone(replay, 0, self.sensor_config)
            if replay.done:
                break
        return replay


def step_of(observed):
    """Return what an agent for a single environment receives."""
    (moment,) = observed.moments
    return Step(rows_of(observed.observations, 0), observed.infos.row(0), 0.0, moment.done)


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
