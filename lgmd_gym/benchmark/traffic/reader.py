# pyright: standard
# Not strict: highway-env states few types.
"""Reading of traffic environments: the state at every camera frame, for later drawing."""

from typing import NamedTuple

import numpy as np

from lgmd_gym.agents import to_action
from lgmd_gym.aliases import Info
from lgmd_gym.envs.traffic.env import TrafficEnv
from lgmd_gym.sensing.assembly import EgoMotion, EgoPose
from lgmd_gym.sensing.highway import on_road_step
from lgmd_gym.sensing.sensor_array import SensorArray


class SceneFrame(NamedTuple):
    """The state of an environment at one camera frame, from which cameras can draw it at any time."""

    time: float  # simulated time since the reset [s]
    speed: float  # ego speed [m/s]
    scene: np.ndarray  # `SCENE` record, see `plain`
    objects: np.ndarray  # `OBJECT` records, see `plain`
    top_views: tuple[np.ndarray, ...] = ()  # frames of bird's-eye cameras, which only highway-env can draw


class Moment(NamedTuple):
    """Result of a reset or of one decision of a traffic environment, before its frames are drawn."""

    info: Info  # info of the environment
    motion: EgoMotion  # motion of the ego in the decision
    frames: tuple[SceneFrame, ...]  # camera frames since the last decision
    done: bool  # whether the episode has ended


def plain(records: np.ndarray) -> np.ndarray:
    """Return a view of records that NumPy copies at once; it copies structured ones field by field."""
    return records.view(np.dtype((np.void, records.itemsize)))


class SceneReader:
    """Steps a traffic environment and reads the state at every camera frame.

    Args:
        env: The environment.
        sensors: Cameras of a batch of environments.
        index: Index of the environment in the batch.
        fps: Camera frame rate [Hz].
        decision: Number of decisions since the reset, for an environment that has been reset before.
    """

    def __init__(
        self, env: TrafficEnv, sensors: SensorArray, index: int, fps: float, decision: int = 0
    ) -> None:
        self.env, self.sensors, self.index = env, sensors, index
        self._hz = env.config["simulation_frequency"]
        self._stride = round(self._hz / fps)
        self._top_views = sensors.top_views
        self._scene, self._objects = plain(sensors.scenes)[index : index + 1], plain(sensors.objects)[index]
        self._substeps = decision * (self._hz // env.config["policy_frequency"])
        self._frames: list[SceneFrame] = []
        on_road_step(env, self._on_substep)

    def reset(self, seed: int) -> Moment:
        """Reset the environment and read the first frame."""
        _, info = self.env.reset(seed=seed)
        self.sensors.set_scene(self.index, self.env.scene, self.env.brake.max_deceleration)
        on_road_step(self.env, self._on_substep)
        self._substeps, self._frames = 0, []
        self._read()
        return Moment(info, EgoMotion(float(self.env.ego.speed), 0.0, 0.0), tuple(self._frames), False)

    def step(self, demand: float | None = None) -> Moment:
        """Advance by one decision and read its frames; None keeps the last demand."""
        env, substeps, self._frames = self.env, self._substeps, []
        before = _pose(env)
        if demand is not None:
            env.action_type.act(to_action(demand))
        info, done = env.advance()
        motion = EgoMotion.between(before, _pose(env), (self._substeps - substeps) / self._hz)
        return Moment(info, motion, tuple(self._frames), done)

    def _on_substep(self) -> None:
        self._substeps += 1
        if self._substeps % self._stride == 0:
            self._read()

    def _read(self) -> None:
        sensors, i = self.sensors, self.index
        sensors.read(self.env, i)
        objects = self._objects[: sensors.object_counts[i]].copy()
        top_views = tuple(sensors.frame_of(k, i).copy() for k in self._top_views)
        time, speed = self._substeps / self._hz, float(self.env.ego.speed)
        self._frames.append(SceneFrame(time, speed, self._scene.copy(), objects, top_views))


def _pose(env: TrafficEnv) -> EgoPose:
    return EgoPose(float(env.ego.heading), float(env.ego.speed))
