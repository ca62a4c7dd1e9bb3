"""The engine and single environments draw pedestrians, bicycles and motorcycles alike."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.vectors import assert_equal_steps, make_pair

from lgmd_gym.camera.objects import MODEL_BICYCLE, MODEL_MOTORCYCLE, MODEL_PEDESTRIAN
from lgmd_gym.camera.scene_table import SceneTable
from lgmd_gym.envs import env_id
from lgmd_gym.envs.families import FAMILIES
from lgmd_gym.envs.families.scenario import ADULT_SIZE, BICYCLE_SIZE, MOTORCYCLE_SIZE

SIZES = {"pedestrian": ADULT_SIZE, "bicycle": BICYCLE_SIZE, "motorcycle": MOTORCYCLE_SIZE}


@pytest.fixture
def figures(monkeypatch):
    """Replace the pedestrian of a family by three moving figures side by side."""
    original = FAMILIES["PedestrianPass"]

    def with_figures():
        made = original(ego_speed=10.0)
        actors = [
            replace(
                made.actors[0], kind=kind, lateral_offset=-2.0 - 1.5 * index, shade=70,
                length=size[0], width=size[1], height=size[2],
            )
            for index, (kind, size) in enumerate(SIZES.items())
        ]  # fmt: skip
        return replace(made, actors=tuple(actors))

    monkeypatch.setitem(FAMILIES, "PedestrianPass", with_figures)


def no_brake(rng, num_envs):
    return np.zeros((num_envs, 1), np.float32)


@pytest.mark.parametrize("weather", ["clear", "night"])
def test_engine_equals_single_environments(figures, weather):
    reference, engine = make_pair(
        env_id("PedestrianPass"), 2, "SameStep", 1, include_frame=True, weather=weather
    )
    assert_equal_steps(reference, engine, 90, np.random.default_rng(0), no_brake)
    reference.close()
    engine.close()


def test_objects_of_the_road_equal_those_of_the_physics(figures):
    """Cameras of other highway-env environments read the road; those of this one read the physics."""
    env = gym.make(env_id("PedestrianPass"))
    env.reset(seed=0)
    for _ in range(50):
        env.step(np.zeros(1, np.float32))
    table = SceneTable()
    table.read(env.unwrapped, None)
    written = env.get_wrapper_attr("sensors").objects[0, : len(SIZES)]
    assert written["travelled"].min() > 2.0
    assert written["model"].tolist() == [MODEL_PEDESTRIAN, MODEL_BICYCLE, MODEL_MOTORCYCLE]
    assert table.object_counts[0] == len(SIZES)
    for name in written.dtype.names:
        assert table.objects[0, : len(SIZES)][name].tolist() == written[name].tolist(), name
    env.close()
