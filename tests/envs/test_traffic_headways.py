"""Time headways of the drivers in traffic."""

from math import inf

import numpy as np
import pytest
from support.traffic import run_for

from lgmd_gym.envs.registration import TRAFFIC_KINDS, make_traffic
from lgmd_gym.envs.traffic.cars import HEADWAYS


@pytest.mark.parametrize("kind", TRAFFIC_KINDS)
def test_drivers_draw_their_headways_from_the_seed(kind):
    wanted = []
    for seed in (1, 1, 2):
        env = make_traffic(kind, camera=None)
        env.reset(seed=seed)
        wanted.append([car.TIME_WANTED for car in env.road.vehicles])
    assert wanted[0] == wanted[1] != wanted[2]
    assert all(HEADWAYS[0] <= time <= HEADWAYS[1] for time in wanted[0])
    assert len(set(wanted[0])) == len(wanted[0])


@pytest.mark.parametrize("kind", ["highway", "two-way"])
def test_traffic_contains_close_following(kind):
    """The fifth percentile of the ego's headways behind a lead is about 1 s; without contact."""
    headways = []
    for seed in range(6):
        env = make_traffic(kind, camera=None, config={"duration": 30})
        env.reset(seed=seed)
        for info in run_for(env, 30):
            assert not info["collision"]
            if info["ego_speed"] > 1.0 and 0.0 < info["target_speed"] < inf:
                headways.append(info["gap"] / info["ego_speed"])
    assert 0.7 < np.percentile(headways, 5) < 1.4
