"""Camera frame rates of highway-env simulations."""

import warnings
from math import ceil

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
