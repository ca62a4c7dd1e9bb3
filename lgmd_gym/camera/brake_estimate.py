"""The car's estimate of the deceleration of full braking, as a sensor may use it."""

from functools import lru_cache

import numpy as np

from lgmd_gym.camera.params import CameraParams

ERROR = 0.07
"""Standard deviation of the estimate in numbered worlds, as a share of the true deceleration; errors are at
most twice as large. An assumption for an estimate of the friction from wheel slip, rain sensor and
temperature."""
_STREAM = 13  # second part of the seed, which separates the error from other draws of the same world


def known_deceleration(p: CameraParams) -> float:
    """Return the car's estimate of its full braking [m/s²].

    It is `max_deceleration` with an error that is constant in a world: normally distributed, see `ERROR`. The
    laboratory has no error.
    """
    return p.max_deceleration * (1.0 + _error(p.world))


@lru_cache(maxsize=1024)
def _error(world: int | None) -> float:
    """Return the relative error of the estimate in a world; 0 in the laboratory."""
    if world is None:
        return 0.0
    drawn = float(np.random.default_rng([world, _STREAM]).standard_normal())
    return ERROR * max(-2.0, min(2.0, drawn))
