"""The loop of the fuzz commands: seeded random cases for a limited time."""

import argparse
import time
import traceback

import numpy as np


def run_cases(draw_case, description, arguments=None):
    """Run random cases until the time is over, and print those that fail.

    Args:
        draw_case: Function of a random generator; returns the description of a case, and a function that
            raises an error if the case fails.
        description: Text of --help.
        arguments: Command line; None for that of the process.

    Returns:
        Exit status: 0, or 1 if a case failed.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--seconds", type=float, default=60.0, help="time limit [s], default 60")
    parser.add_argument("--cases", type=int, default=None, help="limit of the number of cases")
    parser.add_argument("--seed", type=int, default=0, help="seed of the first case; the next is seed + 1")
    options = parser.parse_args(arguments)
    end, seed, failed = time.monotonic() + options.seconds, options.seed, 0
    while time.monotonic() < end and (options.cases is None or seed < options.seed + options.cases):
        failed += not _passes(draw_case, seed)
        seed += 1
    print(f"{seed - options.seed} cases from seed {options.seed}, {failed} failed")
    return int(failed > 0)


def _passes(draw_case, seed):
    """Run one case; prints its seed, its description and the error if it fails."""
    text, check = draw_case(np.random.default_rng(seed))
    try:
        check()
    except Exception:
        print(f"--seed {seed} --cases 1: {text}\n{traceback.format_exc()}")
        return False
    return True
