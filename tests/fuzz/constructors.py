"""Odd arguments of public constructors and functions: `python tests/fuzz/constructors.py --seconds 120`.

A case is a valid call with one or two arguments replaced by odd values. It must end with a ValueError or
TypeError of one line that contains the value or the name of the argument. If it succeeds, the odd values must
be of the annotated type (no bool or string as a number, no NaN), and the result must work.
"""

import math
import os
import re
import signal
import sys
import tempfile
import warnings
from numbers import Integral, Real
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parents[1])]

import gymnasium as gym
import numpy as np
from support.constructors import SMALL, argument_text, made, targets
from support.fuzz import run_cases

from lgmd_gym.errors import shown

NAMES = {"spec": ["params"], "text": ["agent", "suite"], "paths": ["path", "clip"], "sensors_of": ["agent"]}
NAMES |= {"path": ["policy", "clip", "video", "file"], "family": ["scenario"], "name": ["scenario", "suite"]}
NAMES |= {"fps": ["clip"], "size": ["clip"], "file": ["hyperparameters"], "ego_speed": ["speed"]}
NAMES |= {"agent": ["rule"], "algo": ["algorithm"], "seeds": ["seed"]}  # other names of arguments
LIMIT_S = 20  # time after which a call counts as hanging [s]
VALUES = (
    None, True, False, "", "nix", "1", "[red]", "x" * 5000, "a\nb", "fog", b"", b"1", -1, 0, 1, 2, 7, 1.5,
    -0.5, 1e400, -1e400, math.nan, 10**9, 10**19, 10**400, -(10**400), 10**5000, 1e-320, 1e300, 1j, [], [1],
    [None], ["fovea"], [[]], (), (1, 2), (0, 0), (-1, 4), (10**9, 4), (1.5, 2.5), (8, 8, 8), ("a", "b"), {},
    {"a": 1}, {None: 1}, {"name": "wide"}, {"shape": [8, 8]}, {1, 2}, object(), object, print,
    Path("nodir/x"), np.nan, np.float32(1.5), np.float64(np.nan), np.int64(3), np.uint8(200),
    np.bool_(True), np.array(2.0), np.zeros(0), np.zeros((2, 2)), np.full((8, 8), 2, np.int8),
    np.ones((8, 8), np.bool_), np.ones((90, 160), np.float16), np.array(["a"]), np.array([None, 1], object),
    np.zeros((8, 8), np.complex128), range(3), "birdseye", ["fovea", "fovea"], {"camera": "fovea"},
    {"seed": -1}, slice(3), Ellipsis, NotImplemented, ValueError("x"),
)  # fmt: skip
INFINITE = {"tau_1", "tau_2", "tau_s", "t_f", "t_ffi", "far_m"}  # where infinity is documented


def acceptable(name, annotation, value):
    """Return whether a value is of the annotated type; True for annotations other than of plain values."""
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    kinds = set(re.split(r"\s*\|\s*", text))
    if not kinds <= {"float", "int", "bool", "str", "None"} or kinds == {""}:
        return True
    checks = {
        "None": value is None,
        "bool": isinstance(value, bool | np.bool_),
        "str": isinstance(value, str) or (name == "panorama" and isinstance(value, Path)),
        "int": _is_number(value) and value == int(value),
        "float": _is_number(value) or (name in INFINITE and value == math.inf),
    }
    return any(checks[kind] for kind in kinds)


def _is_number(value):
    return (
        isinstance(value, Real)
        and not isinstance(value, bool)
        and (isinstance(value, Integral) or math.isfinite(value))
    )


def check_message(error, changes):
    """Assert that a message has one line and contains one of the changed arguments or values."""
    message = str(error)
    assert len(message.strip().splitlines()) == 1, f"{type(error).__name__}: {message!r}"
    assert len(message) < 600, f"{len(message)} characters: {message[:80]}"
    parts = [part for item in changes.items() for part in _parts(*item)]
    assert any(part in message for part in parts), f"names no argument: {message}"


def _parts(name, value):
    """Yield texts of which a message about an argument contains one: names, and the starts of values."""
    yield from {name, name.replace("_", " "), name.removesuffix("s"), *NAMES.get(name, ())}
    yield shown(value)[:12]
    if isinstance(value, dict | list | tuple):
        for item in value:
            yield shown(item)[:12]


def draw_case(rng):
    """Return the description and the check of one call."""
    name, function, valid, types, use = targets()[rng.integers(len(targets()))]
    names = [str(item) for item in rng.permutation(list(types))[: rng.choice((1, 1, 1, 2))]]
    changes = {item: VALUES[rng.integers(len(VALUES))] for item in names}

    def check():
        signal.alarm(LIMIT_S)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                warnings.simplefilter("error", RuntimeWarning)
                result = function(**{**valid, **changes})
                for item, value in changes.items():
                    ignored = changes.get("camera", 0) is None  # without a camera
                    assert ignored or acceptable(item, types[item], value), f"{item} accepted"
                if use is not None:
                    use(result)
        except (ValueError, TypeError) as error:
            if type(error).__mro__[1] not in (Exception, ValueError):
                raise
            return check_message(error, changes)
        finally:
            signal.alarm(0)
        return None

    return (
        f"{name}({', '.join(f'{item}={argument_text(value)[:60]!r}' for item, value in changes.items())})",
        check,
    )


def _hang(*_):
    raise TimeoutError(f"no end within {LIMIT_S} s")


if __name__ == "__main__":
    made(gym.make("LGMD/CCRs-v0", render_mode="rgb_array"))  # compile the kernels without a time limit
    made(gym.make_vec("LGMD/CCRs-v0", num_envs=2, camera=SMALL))
    os.chdir(tempfile.mkdtemp())
    signal.signal(signal.SIGALRM, _hang)
    sys.exit(run_cases(draw_case, __doc__))
