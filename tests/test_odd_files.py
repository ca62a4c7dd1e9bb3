"""Odd files of other people: some cases of each kind of `tests/fuzz/input_files.py`."""

import numpy as np
import pytest
from fuzz.input_files import KINDS, draw_case

CASES = 40
"""Random cases of each kind, at most a second; the command draws more."""


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("ignore::lgmd_gym.errors.InputNote")
def test_odd_files(kind):
    for seed in range(CASES):
        text, check = draw_case(np.random.default_rng(seed), kind)
        try:
            check()
        except Exception as error:
            raise AssertionError(f"--kind {kind} --seed {seed} --cases 1: {text}") from error
