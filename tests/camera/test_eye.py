"""Lenses at one place, which share what they see: each frame is that of the lens alone."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.records import lens_of
from support.roads import box_record

from lgmd_gym import Camera, Mount
from lgmd_gym.agents import make_agent
from lgmd_gym.camera.render.seen import Seen, aim_frustum, make_seen, seen_by
from lgmd_gym.sensing.channel import make_channels
from lgmd_gym.wrappers.observation import LGMDObservation

WORLDS = (6100, 6106, 6112)


def fields(count, **mount):
    """Return cameras at one place that look in different directions with different zoom."""
    return [
        Camera(
            name=f"field{k}",
            shape=(20, 80),
            hfov_deg=6.0 + 4.0 * k,
            mount=Mount(yaw_deg=3.0 * k - 4.0, pitch_deg=0.4 * k - 0.5, **mount),
        )
        for k in range(count)
    ]


def frames_of(cameras, world, weather, steps=4):
    """Return the frames of some decisions of an approach, by camera, and the array of sensors."""
    env = gym.make("LGMD/CPNA-v0", ego_speed=8.3, camera=cameras, world=world, weather=weather)
    env.reset(seed=world)
    while not isinstance(env, LGMDObservation):
        env = env.env
    frames = []
    for _ in range(steps):
        env.step(np.zeros(1, np.float32))
        frames.append([env.sensors.frame_of(k).copy() for k in range(len(cameras))])
    env.close()
    return np.array(frames)


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("weather", ["clear", "night"])
def test_fields_of_one_eye_are_those_of_each_lens_alone(world, weather):
    cameras = fields(4)
    together = frames_of(cameras, world, weather)
    for k, camera in enumerate(cameras):
        assert np.array_equal(together[:, k], frames_of([camera], world, weather)[:, 0])


def test_objects_that_hide_each_other_in_turn_are_drawn_as_for_each_lens_alone():
    """In world 6101, posts and guard rails each seem to hide the other, for the zones of an agent."""
    channels = make_channels(make_agent("stopping-zone").camera)
    cameras = [channel.camera for channel in channels if channel.camera.shape == (20, 80)]
    together = frames_of(cameras, 6101, None, steps=1)
    alone = [frames_of([camera], 6101, None, steps=1)[:, 0] for camera in cameras]
    assert len(cameras) == 7
    for k, frames in enumerate(alone):
        assert np.array_equal(together[:, k], frames), k


def test_cameras_at_two_places_are_drawn_from_their_own():
    left, right = fields(1, left_m=0.8)[0], replace(fields(1, left_m=-0.8)[0], name="right")
    both = frames_of([left, right], 6106, "clear")
    assert not np.array_equal(both[:, 0], both[:, 1])
    assert np.array_equal(both[:, 0], frames_of([left], 6106, "clear")[:, 0])
    assert np.array_equal(both[:, 1], frames_of([right], 6106, "clear")[:, 0])


def bits_of(record, *turns, ahead_only=False):
    """Return which lenses, turned by these angles [rad], may see an object, as bits."""
    arrays = (array.view(np.recarray) if array.dtype.names else array for array in make_seen(1))
    seen = Seen(*arrays)
    for k, turn in enumerate(turns):
        aim_frustum(lens_of(yaw=turn), seen.frusta[k])
    seen.objects[0] = record[0]
    return seen_by(seen.frusta, len(turns), seen.objects[0], ahead_only)


def test_bits_are_the_lenses_that_look_at_an_object():
    ahead, right = box_record(30.0, 0.0, (1.0, 1.0, 1.5)), box_record(0.0, 30.0, (1.0, 1.0, 1.5))
    assert bits_of(ahead, 0.0, np.pi / 2, 0.0) == 0b101
    assert bits_of(right, 0.0, np.pi / 2, 0.0) == 0b010
    assert bits_of(box_record(-30.0, 0.0, (1.0, 1.0, 1.5)), 0.0, np.pi / 2) == 0


def test_no_lens_sees_what_is_beyond_its_range_or_around_the_lens():
    far = box_record(30.0, 0.0, (1.0, 1.0, 1.5))
    far["range"] = 29.0
    assert bits_of(far, 0.0, 0.1) == 0
    assert bits_of(box_record(0.0, 0.0, (4.0, 2.0, 3.0)), 0.0, 0.1) == 0


def test_flat_object_far_below_the_frame_is_left_out_only_where_asked():
    near = box_record(0.6, 0.0, (0.5, 0.5, 0.1))  # the frame shows the ground from 2.5 m on
    assert bits_of(near, 0.0) == 1
    assert bits_of(near, 0.0, ahead_only=True) == 0
