"""Observations, `info` and sensor readings for tests of agents, without an environment."""

from typing import Any, NamedTuple

import numpy as np

from lgmd_gym.agents.rules import Reading
from lgmd_gym.agents.zones import LOW_ZONES, NUM_FIELDS, NUM_ZONES, REACHES


class TraceFrame(NamedTuple):
    time: Any
    ego_speed: Any
    response: Any


class NeuronResponse(NamedTuple):
    spike_frequency: Any
    membrane_potential: Any


def make_step(*frequencies, trace=False, cameras=1, potential=0.5, speed=8.0, yaw_rate=0.0, **truth):
    """Return observation and `info` after camera frames with these spike frequencies [spikes/s].

    With `trace`, `info` contains every frame; ground truth is inf (undefined) unless given.
    """
    observation = {
        "spike_frequency": np.full(cameras, frequencies[-1], np.float32),
        "membrane_potential": np.full(cameras, potential, np.float32),
        "ego_speed": np.array([speed], np.float32),
        "ego_yaw_rate": np.array([yaw_rate], np.float32),
        "frame": np.zeros((90, 160, cameras), np.uint8),
    }
    keys = ("ttc", "ttb", "gap", "target_speed", "ego_speed")
    info = {"lgmd/alert": frequencies[-1] >= 30} | dict.fromkeys(keys, float("inf")) | truth
    if trace:
        potentials = observation["membrane_potential"]
        responses = [NeuronResponse(np.full(cameras, value), potentials) for value in frequencies]
        info["lgmd/trace"] = [TraceFrame(k / 30, speed, item) for k, item in enumerate(responses)]
    return observation, info


def run_agent(agent, *steps):
    """Return the demand for each step."""
    return [float(agent.act(observation, info)[0]) for observation, info in steps]


def to_potential(excitation):
    """Return membrane potentials for excitations: eq. 10."""
    return 1.0 / (1.0 + np.exp(-np.asarray(excitation, float)))


def reading(frequency, potential, speed, yaw_rate):
    """Return the reading of one environment."""
    values = (np.array([value], float) for value in (frequency, potential, speed, yaw_rate))
    return Reading(*values, due=np.ones(1, bool))


def frequency_reading(frequency, speed=8.0, yaw_rate=0.0):
    """Return the reading of one camera with a spike frequency [spikes/s]."""
    return reading(frequency, [0.5], speed, yaw_rate)


def zone_levels(ground=None, upright=None, low=None):
    """Return excitations of the fields of `stopping-zone`, shape (17,).

    Each argument is the excitation at a reach of 1, or a dict of excitations by reach.
    """
    levels = np.zeros(NUM_FIELDS)
    low_reaches = [REACHES[zone] for zone in LOW_ZONES]
    groups = ((0, REACHES, ground), (NUM_ZONES, REACHES, upright), (2 * NUM_ZONES, low_reaches, low))
    for offset, reaches, value in groups:
        for reach, level in ({1.0: value} if np.isscalar(value) else value or {}).items():
            levels[offset + list(reaches).index(reach)] = level
    return levels


def zone_reading(speed=13.0, yaw_rate=0.0, **levels):
    """Return the reading of the cameras of `stopping-zone`; `levels` are those of `zone_levels`."""
    return reading(0.0, to_potential(zone_levels(**levels)), speed, yaw_rate)


def any_brake(rule, readings):
    """Pass all readings to a rule; return whether its condition held for any of them."""
    conditions = [should_brake(rule, reading) for reading in readings]  # the rule counts frames
    return any(conditions)


def should_brake(rule, reading):
    """Return whether the condition of a rule in one environment holds."""
    (condition,) = rule.agent.should_brake(reading)
    return bool(condition)
