"""Base class of rules on the neuron, and its inputs: one `SensorReading` per camera frame."""

from collections.abc import Iterator
from dataclasses import fields
from typing import Any, ClassVar, NamedTuple

import numpy as np

from lgmd_gym.agents.base import LatchingAgent
from lgmd_gym.agents.params import RuleParams
from lgmd_gym.errors import check_type


class SensorReading(NamedTuple):
    """Neuron outputs and ego motion for one camera frame.

    Attributes:
        spike_frequency: Spike frequency of each camera's neuron, shape (cameras,) [spikes/s].
        membrane_potential: K of eq. 10, shape (cameras,), in [0.5, 1].
        speed: Ego speed [m/s].
        yaw_rate: Ego yaw rate, mean over the decision interval [rad/s].
    """

    spike_frequency: np.ndarray
    membrane_potential: np.ndarray
    speed: float
    yaw_rate: float

    @property
    def max_frequency(self) -> float:
        """Highest spike frequency of all cameras [spikes/s]."""
        return float(np.max(self.spike_frequency))


def excitation(membrane_potential: Any) -> np.ndarray:
    """Return the mean excitation k/(n σ3), the inverse of eq. 10, clipped at 15.

    The membrane potential saturates: excitations above 3 map to the interval from 0.95 to 1.
    """
    k = np.minimum(np.maximum(np.asarray(membrane_potential, dtype=np.float64), 0.5), 1.0 - 3e-7)
    return np.log(k / (1.0 - k))


def sensor_readings(observation: dict[str, Any], info: dict[str, Any]) -> Iterator[SensorReading]:
    """Yield one reading per camera frame since the last decision.

    Without `lgmd/trace` in `info`, yield only the reading of the last frame.
    """
    yaw_rate = float(observation["ego_yaw_rate"][0])
    trace = info.get("lgmd/trace")
    if trace is None:
        frequency, potential = observation["spike_frequency"], observation["membrane_potential"]
        yield SensorReading(frequency, potential, float(observation["ego_speed"][0]), yaw_rate)
        return
    for frame in trace:
        response, speed = frame.response, float(frame.ego_speed)
        yield SensorReading(response.spike_frequency, response.membrane_potential, speed, yaw_rate)


def read_ahead(read: np.ndarray, frames: int) -> np.ndarray:
    """Return whether each camera is read in a frame or one of the next ones.

    Args:
        read: Whether a camera is read in a frame, bool, shape (frames, cameras).
        frames: Number of next frames, >= 0.

    Returns:
        bool, shape (frames, cameras).
    """
    counts = np.concatenate([np.zeros((1, read.shape[1]), np.int64), np.cumsum(read, axis=0)])
    first = np.arange(len(read))
    return counts[np.minimum(first + frames + 1, len(read))] > counts[first]


class Rule(LatchingAgent):
    """Base class: brakes fully once `should_brake` returns True for a camera frame, and latches.

    A latched brake is required because a spike frequency of 0 does not imply a free road: when a uniform
    surface fills a narrow field of view, the image is constant and the neuron stops spiking.

    Args:
        params: Parameters; None to build them from `options`.
        options: Fields of the parameters, or `toml` for a file of them.

    Attributes:
        Params: Class of the parameters.
        latching: Whether full braking is held once it has begun.
    """

    Params: ClassVar[type[RuleParams]]
    latching: ClassVar[bool] = True

    def __init__(self, params: RuleParams | None = None, **options: Any) -> None:
        if params is None:
            params = self.Params.from_options(self.name, options)
        elif options:
            raise ValueError(f"params and options exclude each other, got params and {', '.join(options)}")
        self.params: Any = check_type("params", params, self.Params)
        self.reset()

    @classmethod
    def options(cls) -> dict[str, Any]:
        """Return the options of the rule's string with their defaults."""
        return {item.name: item.default for item in fields(cls.Params)}

    def brake_condition(self, observation: dict[str, Any], info: dict[str, Any]) -> bool:
        """Return whether `should_brake` is True for any camera frame since the last decision."""
        return any(self.should_brake(reading) for reading in sensor_readings(observation, info))

    def should_brake(self, reading: SensorReading) -> bool:
        """Return whether the rule's condition holds; called for every camera frame in order."""
        raise NotImplementedError

    def require_cameras(self, given: int, count: int) -> None:
        """Raise ValueError unless readings come from `count` cameras."""
        if given != count:
            raise ValueError(f"{self.name} requires its own {count} cameras, got {given}; leave --camera out")
