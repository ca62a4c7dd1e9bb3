"""Comparison of vector environments."""

import hashlib

import gymnasium as gym
import numpy as np


def digest(item):
    """Return a value that two observations or infos share if and only if they are equal to the bit."""
    if isinstance(item, dict):
        return {key: digest(value) for key, value in sorted(item.items())}
    if isinstance(item, list | tuple):
        return [digest(value) for value in item]
    if isinstance(item, np.ndarray) and item.dtype == object:
        return [digest(value) for value in item.tolist()]
    if isinstance(item, np.ndarray):
        return str(item.dtype), item.shape, hashlib.sha256(np.ascontiguousarray(item)).hexdigest()
    return repr(item)


def differences(one, other, path=""):
    """Return the paths at which two digests differ."""
    if isinstance(one, dict) and isinstance(other, dict):
        keys = sorted(set(one) | set(other))
        return [d for key in keys for d in differences(one.get(key), other.get(key), f"{path}/{key}")]
    return [] if one == other else [path]


def make_pair(env_id, num_envs, autoreset_mode="NextStep", threads=1, **arguments):
    """Return a vector of single environments and the engine."""
    reference = gym.make_vec(
        env_id,
        num_envs=num_envs,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": autoreset_mode},
        **arguments,
    )
    engine = gym.make_vec(
        env_id, num_envs=num_envs, threads=threads, autoreset_mode=autoreset_mode, **arguments
    )
    return reference, engine


def assert_equal_steps(reference, engine, steps, rng, draw, seed=0):
    """Step both with the same random actions and compare all results of every step."""
    disabled = engine.metadata["autoreset_mode"] == gym.vector.AutoresetMode.DISABLED
    one, other = reference.reset(seed=seed), engine.reset(seed=seed)
    assert differences(digest(one[0]), digest(other[0])) == []
    assert differences(digest(one[1]), digest(other[1])) == []
    episodes = 0
    for step in range(steps):
        actions = draw(rng, engine.num_envs)
        one, other = reference.step(actions), engine.step(actions)
        for name, a, b in zip(("obs", "reward", "terminated", "truncated", "info"), one, other, strict=True):
            assert differences(digest(a), digest(b), f"step {step} {name}") == []
        ended = other[2] | other[3]
        episodes += int(ended.sum())
        if disabled and ended.any():
            one = reference.reset(options={"reset_mask": ended})
            other = engine.reset(options={"reset_mask": ended})
            assert differences(digest(list(one)), digest(list(other)), f"step {step} reset") == []
    return episodes


def random_demands(rng, num_envs):
    """Return demands that brake now and then."""
    choices = np.array([0.0, 0.0, 0.0, 0.0, -0.3, -1.0], np.float32)
    return rng.choice(choices, (num_envs, 1))
