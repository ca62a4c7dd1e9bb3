"""Which camera rate a highway-env simulation allows."""

import warnings

EYE_FPS = 30.0  # [Hz]
LOWEST_FPS = 15.0  # [Hz], below which a default makes no sense: the ceiling is 5 spikes/s at 5 Hz


def camera_rate(fps: float | None, simulation_frequency: float) -> float:
    """Return the camera frames per second for a wish and a simulation frequency.

    Args:
        fps: What the user asked for [Hz]; None for 30 where that divides the simulation frequency, else
            every simulation step.
        simulation_frequency: Simulation steps per second [Hz].

    Raises:
        ValueError: If `fps` does not divide, or the simulation is too slow for an eye.
    """
    if fps is not None:
        if not fps > 0.0:
            raise ValueError(f"fps must be > 0 Hz, got {fps!r}")
        if abs(simulation_frequency / fps - round(simulation_frequency / fps)) > 1e-9:
            raise ValueError(
                f"fps {fps:g} Hz does not divide simulation_frequency {simulation_frequency:g} Hz; "
                f"choose one that does, or gym.make(id, config={{'simulation_frequency': {_multiple(fps)}}})"
            )
        return float(fps)
    if simulation_frequency % EYE_FPS == 0:
        return EYE_FPS
    if simulation_frequency < LOWEST_FPS:
        raise ValueError(
            f"simulation_frequency {simulation_frequency:g} Hz is too slow for an eye (15 Hz at least); "
            "use gym.make(id, config={'simulation_frequency': 30})"
        )
    warnings.warn(
        f"the camera runs at simulation_frequency {simulation_frequency:g} Hz, not {EYE_FPS:g}: spike "
        "frequencies depend on the rate; gym.make(id, config={'simulation_frequency': 30}) gives 30 Hz",
        stacklevel=4,
    )
    return float(simulation_frequency)


def _multiple(fps: float) -> str:
    """Return the lowest multiple of `fps` that is a physics rate of 30 Hz or more, as text."""
    rate = fps
    while rate < 30.0:
        rate += fps
    return f"{rate:g}"
