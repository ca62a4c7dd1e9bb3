"""Rate of EnvPool's highway-v0 with two cars, which has no frames; needs a Python with `pip install envpool`.

`ENVPOOL_PYTHON=/path/to/python python tests/bench/table.py` runs this file for a row of the speed table.
"""

import statistics
import time

import envpool
import numpy as np


def main(num_envs=64, threads=2, rounds=9, steps=40):
    """Print the median number of decisions per second."""
    # The road of `make_top_view`.
    config = {"vehicles_count": 1, "lanes_count": 3, "simulation_frequency": 30, "policy_frequency": 30}
    envs = envpool.make_gymnasium("highway-v0", num_envs=num_envs, num_threads=threads, **config)
    envs.reset()
    actions, rates = np.ones(num_envs, np.int32), []
    for _ in range(rounds):
        start = time.perf_counter()
        for _ in range(steps):
            envs.step(actions)
        rates.append(steps * num_envs / (time.perf_counter() - start))
    print(statistics.median(rates))


if __name__ == "__main__":
    main()
