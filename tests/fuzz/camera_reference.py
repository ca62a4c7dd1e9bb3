"""Random scenes against a slow reference of the camera: `python tests/fuzz/camera_reference.py --seconds 60`.

The light of every pixel must be that of many rays through it, within the error of their number.
"""

import copy
import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

from fuzz.camera import draw_camera, draw_scene
from reference.camera import separate_objects, worst_error
from support.cameras import rig
from support.fuzz import run_cases


def check(env, params):
    """Compare one frame with the reference."""
    separate_objects(env, params)
    worst = worst_error(params, env)
    assert worst <= 1.0, f"{worst:.2f} times the tolerance"


def draw_case(rng):
    """Return the description of a random scene with one camera, and its check."""
    text, env = draw_scene(rng)
    shape = tuple(rng.integers(4, 48, 2).tolist())
    params = rig(draw_camera(rng, "one", shape), panorama="skyline", shutter_s=0.0, guard_rail=False)
    params = rig(params, linear_light=False)
    # Ground nearer than the near plane is drawn without road. Pieces of a rail that meet have no order.
    params = rig(params, height_m=max(params.height_m, 0.4))
    if params.light == "night":
        params = rig(params, vehicles="box")  # no halos of headlights
    return f"{text} {params}", lambda: check(copy.deepcopy(env), params)


if __name__ == "__main__":
    sys.exit(run_cases(draw_case, __doc__))
