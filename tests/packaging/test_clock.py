"""Time measurement in kernels: nothing without the variable, ticks per stage with it."""

import os
import subprocess
import sys

import numpy as np

from lgmd_gym.kernels.clock import START, mark

CODE = """
import numpy as np
from lgmd_gym.kernels.clock import START, mark, ticks
clock = np.zeros(3, np.int64)
before = ticks()
mark(clock, START)
mark(clock, np.int64(1))
mark(clock, np.int64(2))
mark(clock, np.int64(1))
assert before <= clock[0] <= ticks() and clock[1] > 0 and clock[2] > 0, clock
assert clock[1] + clock[2] <= clock[0] - before
"""


def test_without_the_variable_nothing_is_measured():
    clock = np.zeros(2, np.int64)
    mark(clock, START)
    mark(clock, np.int64(1))
    assert not clock.any()


def test_ticks_are_added_to_the_stage_that_ends(tmp_path):
    variables = {"LGMD_GYM_PROFILE": "1", "NUMBA_CACHE_DIR": str(tmp_path), "LGMD_GYM_QUIET": "1"}
    subprocess.run([sys.executable, "-c", CODE], env=os.environ | variables, check=True)
