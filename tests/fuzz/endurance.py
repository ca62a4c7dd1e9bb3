"""Memory, files and threads over many steps: `python tests/fuzz/endurance.py braking --steps 200000`.

Random actions, with a reset at the end of each episode. After a quarter of the steps, the resident memory may
grow by 10 MiB, and the numbers of open files and threads may not grow.
"""

import argparse
import os
import re
import sys
import time
from pathlib import Path
from typing import NamedTuple

import gymnasium as gym
import highway_env  # noqa: F401 - registers highway-v0

from lgmd_gym import LGMDObservation

ALLOWED_MIB = 10.0  # growth of the resident memory
SAMPLES = 20
# One frame per step of highway-v0 [Hz], few vehicles, and an observation without pandas: 200,000 steps of the
# defaults take hours.
HIGHWAY = {
    "simulation_frequency": 15,
    "policy_frequency": 15,
    "vehicles_count": 10,
    "observation": {"type": "LidarObservation", "cells": 4},
}

LABORATORY = "laboratory"  # each new world fills caches, up to 110 MB of textures and skylines


class Usage(NamedTuple):
    """Resources of this process."""

    resident: float  # [MiB]
    peak: float  # of the resident memory [MiB]
    files: int
    threads: int


def usage():
    """Return the resources that this process uses now."""
    status = Path("/proc/self/status").read_text()
    resident, peak, threads = (
        int(re.search(rf"{name}:\s+(\d+)", status)[1]) for name in ("VmRSS", "VmHWM", "Threads")
    )
    return Usage(resident / 1024, peak / 1024, len(os.listdir("/proc/self/fd")), threads)


class Single:
    """Steps of a single environment, with resets."""

    def __init__(self, make):
        self.env, self.ended, self.episodes = make(), True, 0

    def step(self):
        """Do one step, after a reset if necessary, and return the number of steps done."""
        if self.ended:
            self.env.reset(seed=self.episodes)
            self.episodes += 1
        *_, terminated, truncated, _ = self.env.step(self.env.action_space.sample())
        self.ended = terminated or truncated
        return 1


class Vector:
    """Steps of the vector engine, which resets by itself."""

    def __init__(self):
        self.env, self.episodes = gym.make_vec("LGMD/RandomBraking-v0", num_envs=8, world=LABORATORY), 8
        self.env.reset(seed=0)

    def step(self):
        """Do one step in each environment and return the number of steps done."""
        *_, terminated, truncated, _ = self.env.step(self.env.action_space.sample())
        self.episodes += int((terminated | truncated).sum())
        return self.env.num_envs


KINDS = {
    "braking": lambda: Single(lambda: gym.make("LGMD/RandomBraking-v0", world=LABORATORY)),
    "highway": lambda: Single(lambda: LGMDObservation(gym.make("highway-v0", config=HIGHWAY), fps=15)),
    "vector": Vector,
}


def measure(steps, limit, seconds, log=print):
    """Do steps and return the resources at regular intervals of the steps, or of the time if that ends first.

    Args:
        steps: Object with the method `step`.
        limit: Number of steps.
        seconds: Time limit [s].
        log: Function that gets a line per sample.
    """
    start, done, samples = time.monotonic(), 0, []
    steps.env.action_space.seed(0)
    while True:
        part = max(done / limit, (time.monotonic() - start) / seconds)
        if part * SAMPLES >= len(samples) or part >= 1.0:
            samples.append(usage())
            log(f"{done:7d} steps, {steps.episodes:5d} episodes, {time.monotonic() - start:6.1f} s: "
                f"{samples[-1].resident:6.1f} MiB, peak {samples[-1].peak:6.1f} MiB, "
                f"{samples[-1].files} files, {samples[-1].threads} threads")  # fmt: skip
        if part >= 1.0:
            steps.env.close()
            return samples
        done += steps.step()


def findings(samples):
    """Return a line per resource that has grown since the first quarter of the samples."""
    settled, last = samples[len(samples) // 4], samples[-1]
    grown = [
        f"{name} grew from {getattr(settled, name)} to {getattr(last, name)}"
        for name in ("files", "threads")
        if getattr(last, name) > getattr(settled, name)
    ]
    growth = last.resident - settled.resident
    return grown + ([f"memory grew by {growth:.1f} MiB"] if growth > ALLOWED_MIB else [])


def main():
    """Do the steps and print the resources; return 1 if one has grown."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("kind", choices=KINDS, help="environment")
    parser.add_argument("--steps", type=int, default=200_000, help="number of steps, default 200000")
    parser.add_argument("--seconds", type=float, default=600.0, help="time limit [s], default 600")
    options = parser.parse_args()
    found = findings(measure(KINDS[options.kind](), options.steps, options.seconds))
    print("\n".join(found or ["nothing has grown"]))
    return int(bool(found))


if __name__ == "__main__":
    sys.exit(main())
