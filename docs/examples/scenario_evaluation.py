"""Scenario evaluation: how late may the alert come? Time to contact at the alert over speed and lens.

    python docs/examples/scenario_evaluation.py

Nothing brakes here: the neuron only watches approaches to a standing car, so that lenses can be compared
on the same drive. Braking from 50 km/h at 9 m/s² takes about one second of time to contact.
"""

import gymnasium as gym
import numpy as np

import lgmd_gym  # noqa: F401  (registers the environments)


def ttc_at_alert(camera: str, kmh: float, seed: int) -> float:
    """Return the time to contact [s] at the first alert of an undisturbed approach; NaN without one."""
    env = gym.make("LGMD/CCRs-v0", ego_speed=kmh / 3.6, camera=camera)
    _, info = env.reset(seed=seed)
    hold = np.zeros(1, np.float32)
    while not info["collision"]:
        if info["lgmd/alert"]:
            return float(info["ttc"])
        *_, info = env.step(hold)
    return float("nan")


def main(
    cameras: tuple[str, ...] = ("wide", "tele", "fovea"),
    speeds: tuple[int, ...] = (10, 30, 50),
    seeds: int = 3,
) -> None:
    """Print the median over seeds for each lens and speed."""
    print("km/h   " + "".join(f"{camera:>10}" for camera in cameras))
    for kmh in speeds:
        medians = [
            np.median([ttc_at_alert(camera, kmh, seed) for seed in range(seeds)]) for camera in cameras
        ]
        print(f"{kmh:4}   " + "".join(f"{value:8.2f} s" for value in medians))


if __name__ == "__main__":
    main()
