"""Schedules of the cameras of a recording: only those that an agent reads are drawn.

Frames are drawn in two passes. The first pass draws the cameras that the agents may read at the recorded
speeds. Its readings decide which further cameras matter, and the second pass draws these.
"""

from collections.abc import Sequence

import numpy as np

from lgmd_gym.agents import Agent
from lgmd_gym.agents.rule import read_ahead
from lgmd_gym.benchmark.traffic.reader import Moment
from lgmd_gym.neuron import Response

WARM_UP = 60
"""Camera frames from the start of a neuron to its first reading. The slowest filter of the default neuron has
a time constant of 180 ms: after 2 s the part of its initial value is 3e-5."""


class CameraSchedule:
    """The cameras to draw for each decision of a recording.

    Args:
        moments: The moments of the recording.
        agents: The agents that run on it.
        num_cameras: Number of cameras.

    Attributes:
        first: Cameras to draw in the first pass, bool, shape (decisions, cameras); None for no first pass:
            the second one then draws all cameras.
        second: The same for the second pass; None before `plan_second_pass`, or for all.
    """

    def __init__(self, moments: Sequence[Moment], agents: Sequence[Agent], num_cameras: int) -> None:
        self._speed = np.array([moment.speed for moment in moments])
        # float32, as in the observation
        self._yaw_rate = np.array([moment.yaw_rate for moment in moments], np.float32)
        self._agents = agents
        self._outputs: list[list[np.ndarray]] = []
        self.first: np.ndarray | None = None
        self.second: np.ndarray | None = None
        self._read: np.ndarray | None = None
        if all(len(moment.frames) == 1 for moment in moments):
            self._read = self._cameras_in_use(num_cameras)
        if self._read is not None:
            self.first = read_ahead(self._read, WARM_UP)

    def store(self, responses: Response, index: int) -> None:
        """Store the outputs of environment `index` for the next decision of the first pass."""
        self._outputs.append([field[index].copy() for field in responses])

    def plan_second_pass(self) -> None:
        """Choose the cameras of the second pass from the stored outputs."""
        if self._read is None or not self._outputs:
            return
        column = Response._fields.index("membrane_potential")
        potential = np.array([outputs[column] for outputs in self._outputs])
        read = self._cameras_in_use(potential.shape[1], potential)
        assert read is not None
        self.second = read_ahead(read & ~self._read, WARM_UP)

    def restore(self, decision: int, responses: Response, index: int) -> None:
        """Write the outputs of the first pass at a decision into those of environment `index`."""
        if self._read is not None:
            cameras = self._read[decision]
            for field, values in zip(responses, self._outputs[decision], strict=True):
                np.copyto(field[index], values, where=cameras)

    def _cameras_in_use(self, num_cameras: int, potential: np.ndarray | None = None) -> np.ndarray | None:
        """Return when any agent reads which cameras; None for always all."""
        read = np.zeros((len(self._speed), num_cameras), np.bool_)
        for agent in self._agents:
            cameras = agent.cameras_in_use(self._speed, self._yaw_rate, potential)
            if cameras is None or cameras.shape != read.shape:  # the user may have specified other cameras
                return None
            read |= cameras
        return read
