"""Compilation of the kernels at the first use, in two processes at once.

Numba compiles one kernel after the other, each at its first call. The kernel that draws cameras takes two
thirds of the time. A second process compiles motion and the last stages of drawing meanwhile, for numba's
cache, where the first process finds them when it comes to them.
"""

import os
import subprocess
import sys

import gymnasium as gym
import numpy as np
from highway_env.road.road import RoadNetwork
from numba.core import config

from lgmd_gym.camera import Camera
from lgmd_gym.camera.pose import USUAL_BRAKE
from lgmd_gym.camera.render.raster import Workspace, draw_cameras, draw_last_stages
from lgmd_gym.camera.scene import Scene
from lgmd_gym.envs.decisions import advance
from lgmd_gym.envs.registration import env_id
from lgmd_gym.kernels.compilation import VARIABLE, expected_functions
from lgmd_gym.kernels.kernel import Kernel, is_cached
from lgmd_gym.neuron import LGMD
from lgmd_gym.processes.pool import signals_blocked, watch_parent
from lgmd_gym.sensing.drawing import Drawing

FUNCTIONS = 165  # compiled by the first process, those of numba included
_HELPER = f"from {__name__} import _compile_others; _compile_others()"


def compile_kernels() -> None:
    """Compile the kernels of a braking environment with the LGMD, unless numba's cache has them.

    Those of other neurons and of traffic are compiled where they are used.
    """
    if config.DISABLE_JIT or all(map(is_cached, (draw_cameras, advance))):  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]
        return
    with expected_functions(FUNCTIONS):
        helper = None
        try:
            with signals_blocked():
                helper = _start_helper()
            _draw_camera()
            _plant_roadside()
            _step_neuron()
            if helper is not None:
                helper.wait()
        finally:
            if helper is not None:
                helper.kill()
                helper.wait()
        _step_environment()  # compiles what connects the two, and all that a helper that failed has left


def _start_helper() -> "subprocess.Popen[bytes] | None":
    """Start the second process; None if the system cannot."""
    # The same modules as in this process: -P leaves out the working directory, unless it is in the path.
    path = os.pathsep.join(str(folder) or os.getcwd() for folder in sys.path)
    try:
        return subprocess.Popen(
            [sys.executable, "-P", "-c", _HELPER],
            env=os.environ | {VARIABLE: "1", "PYTHONPATH": path},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
    except (OSError, TypeError, ValueError):
        return None


def _compile_others() -> None:  # pyright: ignore[reportUnusedFunction]
    """Compile the last stages of drawing and the kernels of motion; end with the first process."""
    watch_parent(os.getppid())
    # First, so that they are in the cache when the first process comes to them.
    drawing = _make_drawing()
    group = drawing.groups[0]
    inputs = Workspace(group.batch.shape).join(
        group.batch.bundle, drawing.scene_table.bundle, drawing.roads.bundle
    )
    if isinstance(draw_last_stages, Kernel):
        draw_last_stages.compile_inner(group.frames, inputs.native)
    _step_environment(camera=None)


def _make_drawing() -> Drawing:
    """Return a camera on a road."""
    drawing = Drawing([Camera()], [[0]], 1)
    drawing.set_road(0, RoadNetwork.straight_road_network(2))
    return drawing


def _draw_camera() -> None:
    """Draw one frame."""
    _make_drawing().draw(0, 0, 1, np.ones((1, 1), np.bool_))


def _step_neuron() -> None:
    """Step an LGMD once."""
    shape = Camera().shape
    LGMD(shape).step(np.zeros(shape, np.uint8))


def _plant_roadside() -> None:
    """Compile what draws the roadside of a world at the start of an episode."""
    scene = Scene(world=0)
    drawing = Drawing([Camera()], [[0]], 1)
    drawing.set_scene(0, scene, USUAL_BRAKE)
    drawing.set_road(0, RoadNetwork.straight_road_network(2))


def _step_environment(**arguments: None) -> None:
    """Step an environment once."""
    env = gym.make(env_id("RandomBraking"), **arguments)
    env.reset(seed=0)
    env.step(np.zeros(1, np.float32))
    env.close()
