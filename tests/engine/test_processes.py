"""The engine in forked and spawned processes, after its threads have run in the parent."""

import multiprocessing
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv
from support.vectors import differences, digest

ENV = "lgmd_gym:LGMD/RandomBraking-v0"
pytestmark = pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")


def drive(envs, steps):
    """Return the digests of steps with constant braking, which ends episodes."""
    actions = np.full(envs.action_space.shape, -1.0, np.float32)
    return [digest(list(envs.step(actions))) for _ in range(steps)]


def _send(queue, envs, steps):
    queue.put(drive(envs, steps))


@pytest.mark.parametrize("threads", [1, 2])
def test_forked_child_continues_the_episodes_of_its_parent(threads):
    envs = gym.make_vec(ENV, num_envs=4, threads=threads, include_frame=True)
    envs.reset(seed=0)
    drive(envs, 60)
    context = multiprocessing.get_context("fork")
    queue = context.SimpleQueue()
    child = context.Process(target=_send, args=(queue, envs, 60), daemon=True)
    child.start()
    results = queue.get()
    child.join(60)
    assert child.exitcode == 0
    assert results == drive(envs, 60)
    envs.close()


@pytest.mark.parametrize("context", ["fork", pytest.param("spawn", marks=pytest.mark.slow)])
def test_async_vector_env_after_use(context):
    engine = gym.make_vec(ENV, num_envs=2, threads=2)
    first, _ = engine.reset(seed=3)
    engine.step(np.zeros((2, 1)))
    workers = AsyncVectorEnv([lambda: gym.make(ENV)] * 2, context=context)
    try:
        observations, _ = workers.reset(seed=3)
        assert differences(digest(first), digest(observations)) == []
    finally:
        workers.close()
    engine.step(np.zeros((2, 1)))
    engine.close()


def test_stable_baselines_workers_after_use():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3.common.vec_env import SubprocVecEnv

    engine = gym.make_vec(ENV, num_envs=2, threads=2)
    engine.reset(seed=3)
    engine.step(np.zeros((2, 1)))
    workers = SubprocVecEnv([lambda: gym.make(ENV)] * 2, start_method="fork")
    try:
        workers.seed(3)
        assert workers.reset()["spike_frequency"].shape == (2, 1)
    finally:
        workers.close()
    engine.close()


@pytest.mark.slow
def test_the_engine_leaves_no_threads_behind():
    """An interpreter that does not close the engine ends, and one thread starts no pool."""
    code = (
        "import threading, gymnasium as gym, numpy as np, lgmd_gym\n"
        "for threads in (1, 2):\n"
        "    envs = gym.make_vec('LGMD/CCRs-v0', num_envs=4, threads=threads)\n"
        "    envs.reset(seed=0)\n"
        "    envs.step(np.zeros((4, 1)))\n"
        "    print(threading.active_count())\n"
        "from numba.np.ufunc import parallel\n"
        "print(parallel._is_initialized)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True
    )
    one, two, initialized = result.stdout.split()
    assert (int(one), initialized) == (1, "False")
    assert int(two) > 1
