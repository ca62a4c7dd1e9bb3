# pyright: standard
# Not strict: highway-env states few types.
"""What cameras need from a highway-env environment: a frame rate, and a callback after each step."""

import warnings
from collections.abc import Callable
from math import ceil
from typing import Any, Protocol, runtime_checkable

import gymnasium as gym

from lgmd_gym.errors import check_finite, check_positive, check_within, shown

DEFAULT_FPS = 30.0  # [Hz]
MIN_FPS = 15.0  # [Hz], for defaults; lower rates bound the spike frequency too much (5 spikes/s at 5 Hz)


def camera_rate(fps: float | None, simulation_frequency: float) -> float:
    """Return the camera frame rate [Hz] for a simulation frequency.

    Args:
        fps: Requested frame rate [Hz]; None for 30 if that divides the simulation frequency, else the
            simulation frequency itself, with a warning.
        simulation_frequency: Simulation frequency [Hz].

    Raises:
        ValueError: If `fps` does not divide the simulation frequency, or if the latter is below 15 Hz.
    """
    check_positive("simulation_frequency", simulation_frequency)
    if fps is not None:
        return _checked_rate(fps, simulation_frequency)
    if simulation_frequency % DEFAULT_FPS == 0:
        return DEFAULT_FPS
    if simulation_frequency < MIN_FPS:
        raise ValueError(
            f"simulation_frequency must be >= {MIN_FPS:g} Hz for a camera, got {simulation_frequency:g}; "
            "use gym.make(id, config={'simulation_frequency': 30})"
        )
    warnings.warn(
        f"the camera runs at simulation_frequency {simulation_frequency:g} Hz, not {DEFAULT_FPS:g} Hz, which "
        "changes spike frequencies; use gym.make(id, config={'simulation_frequency': 30}) for 30 Hz",
        stacklevel=4,
    )
    return float(simulation_frequency)


def _checked_rate(fps: float, simulation_frequency: float) -> float:
    if not check_finite("fps", fps) > 0.0:
        raise ValueError(f"fps must be > 0, got {shown(fps)}")
    check_within("fps", fps, 1e-3, 1e5, "Hz")
    ratio = simulation_frequency / fps
    if abs(ratio - round(ratio)) > 1e-9:
        raise ValueError(
            f"fps must divide simulation_frequency {simulation_frequency:g} Hz, got {fps:g}; use another fps "
            f"or gym.make(id, config={{'simulation_frequency': {fps * ceil(DEFAULT_FPS / fps):g}}})"
        )
    return float(fps)


@runtime_checkable
class SensorHost(Protocol):
    """A highway-env environment that draws the frames of attached cameras inside its own steps.

    Attributes:
        simulation: Row 0 of its arrays is the environment, see `lgmd_gym.envs.simulation.Simulation`.
        rendering_paused: Whether it draws no frames until its next reset.
    """

    simulation: Any
    rendering_paused: bool

    def attach_sensors(self, sensors: Any, camera_hz: float) -> None:
        """Draw the frames of a `SensorArray`, `camera_hz` per second, from the next reset on."""
        ...

    def restart_sensors(self) -> None:
        """Process a first frame of the present state with sensors attached after the reset."""
        ...


class HookedStep:
    """Wrapper of `Road.step` that calls a bound method afterwards; it supports deep copies of the road."""

    def __init__(self, step: Callable[[float], None], callback: Callable[[], None]) -> None:
        self.step = step
        self.callback = callback

    def __call__(self, dt: float) -> None:
        """Step the road by `dt` [s]."""
        self.step(dt)
        self.callback()


def on_road_step(env: gym.Env, callback: Callable[[], None]) -> None:
    """Register a bound method that the current road calls after each step.

    A reset of a highway-env environment creates a new road, so call this function after each reset. A
    repeated call for the same road has no effect.
    """
    road: Any = env.unwrapped.road  # type: ignore[attr-defined]
    if not (isinstance(road.step, HookedStep) and road.step.callback == callback):
        road.step = HookedStep(road.step, callback)


def check_highway_env(env: gym.Env) -> None:
    """Raise ValueError for an environment that is not a highway-env environment."""
    base: Any = getattr(env, "unwrapped", None)
    if not hasattr(base, "road") or "simulation_frequency" not in getattr(base, "config", {}):
        raise ValueError(f"env must be a highway-env environment, got {shown(env if base is None else base)}")
