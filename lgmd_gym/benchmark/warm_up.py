"""Compilation of the kernels before the worker processes start, each of which would compile all of them."""

import contextlib
from typing import Any

from lgmd_gym.benchmark.batch import play_unit
from lgmd_gym.benchmark.task import Task
from lgmd_gym.benchmark.units import Unit
from lgmd_gym.camera.render.context import draw_cameras
from lgmd_gym.engine.kernels import advance


def compile_kernels(task: Task) -> None:
    """Play a task in this process and drop its result, unless numba has the kernels in its cache.

    Args:
        task: A short task; its errors are left to the workers.
    """
    if all(map(_is_cached, (draw_cameras, advance))):
        return
    with contextlib.suppress(Exception, SystemExit):
        next(play_unit(Unit("", [task])))


def _is_cached(kernel: Any) -> bool:
    """Return whether numba's cache has a kernel for the present source."""
    if kernel.signatures:
        return True
    file = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
    return bool(file is not None and file._load_index())
