"""What the rules on the neuron have in common: parameters, what a camera frame tells, and the latch."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Any, ClassVar, NamedTuple

import numpy as np

from lgmd_gym.agents.base import BRAKE, HOLD, Agent
from lgmd_gym.agents.params import RuleParams


class SensorReading(NamedTuple):
    """What the car's own sensors tell at one camera frame.

    Attributes:
        spike_frequency: Of every camera's neuron, shape (cameras,) [spikes/s].
        membrane_potential: K of eq. 10, shape (cameras,), in [0.5, 1].
        speed: Own speed [m/s].
        yaw_rate: Own yaw rate, mean over the decision [rad/s].
    """

    spike_frequency: np.ndarray
    membrane_potential: np.ndarray
    speed: float
    yaw_rate: float


class Rule(Agent):
    """Brakes fully once `should_brake` has said so, and keeps braking to a standstill.

    It latches because silence is not clearance: when a flat-shaded car fills a narrow field nothing moves
    in the image any more and the neuron falls silent at the worst moment.

    Args:
        params: Parameters; None for those of `options`.
        options: Fields of the parameters.
    """

    Params: ClassVar[type[RuleParams]]
    latching: ClassVar[bool] = True  # whether it holds full braking once it has begun

    def __init__(self, params: Any = None, **options: Any) -> None:
        super().__init__()
        self.params: Any = self.Params.from_options(self.name, options) if params is None else params
        self.reset()

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return what its string may set, with the defaults; `toml` beside."""
        return {item.name: item.default for item in fields(cls.Params)}

    @property
    def alert(self) -> bool:
        """Whether it has begun to brake."""
        return self._latched

    def reset(self, seed: int | None = None) -> None:
        """Release the brake."""
        super().reset(seed)
        self._latched = False

    def demand(self, observation: dict[str, Any], info: dict[str, Any]) -> float:
        """Brake fully if latched."""
        for sight in sensor_readings(observation, info):
            self._latched = self.should_brake(sight) or self._latched
        return BRAKE if self._latched else HOLD

    def should_brake(self, sight: SensorReading) -> bool:
        """Return whether a camera frame gives reason to brake; called with every frame, in order."""
        raise NotImplementedError


def sensor_readings(observation: dict[str, Any], info: dict[str, Any]) -> Iterator[SensorReading]:
    """Yield every camera frame since the last decision if `info` carries `lgmd/trace`, else the last one."""
    yaw_rate = float(observation["ego_yaw_rate"][0])
    trace = info.get("lgmd/trace")
    if trace is None:
        frequency, potential = observation["spike_frequency"], observation["membrane_potential"]
        yield SensorReading(frequency, potential, float(observation["ego_speed"][0]), yaw_rate)
        return
    for frame in trace:
        said = frame.response
        yield SensorReading(said.spike_frequency, said.membrane_potential, float(frame.ego_speed), yaw_rate)


class Streak:
    """Counts consecutive frames in which something held."""

    def __init__(self, wanted: int) -> None:
        self.wanted, self.length = wanted, 0

    def add(self, holds: bool) -> bool:
        """Return whether it has held in the wanted number of frames by now."""
        self.length = self.length + 1 if holds else 0
        return self.length >= self.wanted


class SteeringGate:
    """Is shut while the car turns, and for a while after: own rotation moves the whole image.

    Args:
        yaw_rate: From which the car turns [rad/s].
        frames: For how long after [camera frames].
    """

    def __init__(self, yaw_rate: float, frames: int) -> None:
        self.yaw_rate, self.frames = yaw_rate, frames
        self._left = 0

    def open(self, yaw_rate: float) -> bool:
        """Return whether the image can be trusted at this frame, given own yaw rate [rad/s]."""
        turning = abs(yaw_rate) > self.yaw_rate
        self._left = self.frames if turning else max(self._left - 1, 0)
        return self._left == 0
