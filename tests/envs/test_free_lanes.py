"""Lanes that no actor uses, on which queues may stand."""

import gymnasium as gym
import numpy as np
import pytest
from support.cameras import rig

from lgmd_gym.benchmark.suites import SUITES
from lgmd_gym.camera.road_geometry import road_geometry
from lgmd_gym.camera.road_pool import road_key
from lgmd_gym.envs.families.family import make_scenario
from lgmd_gym.envs.families.scenario import LANE_WIDTH, free_lane

RIGHT, LEFT = 2, 0  # of the ego's lane, 1


@pytest.mark.parametrize(
    ("family", "arguments", "lane"),
    [
        ("CCRs", {}, RIGHT),
        ("CCRs", {"beside": True}, RIGHT),
        ("CCRs", {"lateral_offset": -0.8}, RIGHT),
        ("CCRs", {"lateral_offset": -1.2}, LEFT),
        ("CCRs", {"target_heading": 0.35}, RIGHT),
        ("AdjacentPass", {"cars": 3}, RIGHT),
        ("AdjacentPass", {"lateral_offset": -LANE_WIDTH}, LEFT),
        ("PassBetween", {}, None),
        ("PedestrianPass", {}, LEFT),
        ("SteelPlate", {}, RIGHT),
        ("CutIn", {}, None),
        ("Oncoming", {}, None),
        ("CurveGuardRail", {}, None),
        ("CCCscp", {}, None),
        ("EmptyRoad", {}, RIGHT),
    ],
)
def test_free_lane(family, arguments, lane):
    assert free_lane(make_scenario(family, **arguments)) == lane


def test_many_cases_have_a_free_lane():
    suites = ("r152", "fmvss127", "ncap2023", "false-reaction")
    lanes = [free_lane(case.scenario) for suite in suites for case in SUITES[suite].cases]
    assert 0.4 < np.mean([lane is not None for lane in lanes]) < 0.95


def queue_of(env, world, lane):
    """Return the records on the road that stand there because of the queue."""
    with_queue, without = (
        road_geometry(env.unwrapped.road, *road_key(rig(world=world, queue_lane=queue_lane))).roadside
        for queue_lane in (lane, None)
    )
    return with_queue[~np.isin(with_queue, without)]


def test_queues_stand_on_the_free_lane_of_numbered_worlds():
    lengths = []
    for world in range(8000, 8010):
        env = gym.make("LGMD/CCRs-v0", camera="wide", world=world)
        env.reset(seed=0)
        assert env.unwrapped.scene.queue_lane == RIGHT
        queue = queue_of(env, world, RIGHT)
        lane = env.unwrapped.road.network.get_lane(("start", "end", RIGHT))
        across = np.array([lane.local_coordinates((item["x"], item["y"]))[1] for item in queue])
        assert (np.abs(across) <= 0.2).all()
        lengths.append(len(queue))
    assert 3 <= np.count_nonzero(lengths) <= 10


def test_no_queue_stands_in_the_laboratory():
    env = gym.make("LGMD/CCRs-v0", camera="wide", world="laboratory")
    env.reset(seed=0)
    assert len(queue_of(env, None, RIGHT)) == 0


@pytest.mark.parametrize("lane", [-1, 0.5, True, "left"])
def test_refused_lanes(lane):
    with pytest.raises(ValueError, match="scene queue_lane"):
        rig(queue_lane=lane)
