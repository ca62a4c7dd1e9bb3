"""Channels from the arguments of environments."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

from lgmd_gym.camera import BirdsEye, Camera
from lgmd_gym.sensing.channel import Channel, make_channels


@pytest.mark.parametrize("field", ["neuron", "columns"])
def test_fields_of_a_channel_in_a_camera_are_explained(field):
    with pytest.raises(ValueError, match=r"fields of a channel, not of a camera.*use \{'camera'"):
        make_channels({"name": "fovea", field: "dsn"})


@pytest.mark.parametrize("camera", [BirdsEye((60, 80)), Channel(name="top", camera=BirdsEye((60, 80)))])
def test_a_top_view_survives_json(camera):
    env = gym.make("LGMD/CCRs-v0", ego_speed=3.0, camera=camera, include_frame=True)
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_array_equal(env.reset(seed=0)[0]["frame"], again.reset(seed=0)[0]["frame"])
    assert again.unwrapped is not env.unwrapped


def test_the_name_of_the_top_view_is_reserved():
    with pytest.raises(ValueError, match="'birdseye' is that of highway-env's top view; use `BirdsEye`"):
        Camera(name="birdseye")


def test_an_array_is_a_shape():
    assert Camera(shape=np.array([60, 80])).shape == (60, 80)
    assert BirdsEye(np.array([60, 80])).shape == (60, 80)
