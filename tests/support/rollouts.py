"""Episodes with a constant action, which several test files share."""

import numpy as np

HOLD, BRAKE = np.array([0.0], np.float32), np.array([-1.0], np.float32)


def rollout(env, action, steps, seed=0):
    """Return the results of `reset` and of up to `steps` steps as tuples that end with the info."""
    results = [env.reset(seed=seed)]
    for _ in range(steps):
        observation, reward, terminated, truncated, info = env.step(action)
        results.append((observation, reward, info))
        if terminated or truncated:
            break
    return results
