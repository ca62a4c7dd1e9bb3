"""Policy inputs of a recorded episode: the values of `FeatureHistory`, computed for all decisions at once."""

from dataclasses import replace

import numpy as np

from lgmd_gym.agents.policies.features import (
    CLIP,
    FRAME,
    GAINS,
    NUM_LEVELS,
    SCALES,
    ZONE_INPUTS,
    FeatureConfig,
    FeatureHistory,
    levels_of,
    source_observation,
    weaker,
)
from lgmd_gym.training.offline.episodes import Observation


def policy_inputs(
    observations: Observation, features: FeatureConfig, zone_type: type[np.floating] = np.float16
) -> dict[str, np.ndarray]:
    """Return the inputs at each decision of the policy, without a history, (decisions, ...) each.

    Frames are of type uint8, the inputs that are not in `ZONE_INPUTS` of type float32.

    Args:
        observations: Observations of an episode by name, (T, ...) each.
        features: Inputs and timing of the policy.
        zone_type: Type of the inputs in `ZONE_INPUTS`; float16 rounds them to three digits.

    Raises:
        ValueError: If an observation is missing, or comes from other cameras than an input requires.
    """
    for name in map(source_observation, features.inputs):
        if name not in observations:
            raise ValueError(f"the policy requires the observation {name!r}, got {sorted(observations)}")
    inputs: dict[str, np.ndarray] = {}
    for name in features.inputs:
        if name == FRAME:
            inputs[name] = observations[name][:: features.repeat].copy()
        elif name in SCALES:
            offset, scale = SCALES[name]
            values = (observations[name][:: features.repeat] - offset) / scale
            inputs[name] = np.clip(values, -CLIP, CLIP).astype(np.float32)
    inputs |= _zone_inputs(observations, features, zone_type)
    return inputs | _other_inputs(observations, features, inputs)


def _zone_inputs(
    observations: Observation, features: FeatureConfig, zone_type: type[np.floating]
) -> dict[str, np.ndarray]:
    """Return the features of fields; one loop over time computes the averages of all inputs."""
    names = [name for name in features.inputs if name in ZONE_INPUTS]
    if not names:
        return {}
    parts = [levels_of(name, observations[ZONE_INPUTS[name].source]) for name in names]
    levels = np.concatenate(parts, axis=1)
    times = range(0, len(levels), features.repeat)
    table = np.empty((len(times), NUM_LEVELS, levels.shape[1]), zone_type)
    table[:, 0] = weaker(levels, np.concatenate([levels[:1], levels[:-1]]))[:: features.repeat]
    averages = np.zeros((NUM_LEVELS - 1, levels.shape[1]))
    change = np.empty_like(averages)
    for time, level in enumerate(levels):
        np.subtract(level, averages, out=change)
        change *= GAINS
        averages += change
        if time % features.repeat == 0:
            table[time // features.repeat, 1:] = averages
    bounds = np.cumsum([part.shape[1] for part in parts])[:-1]
    tables = np.split(table, bounds, axis=2)
    return {name: values.reshape(len(times), -1).copy() for name, values in zip(names, tables, strict=True)}


def _other_inputs(
    observations: Observation, features: FeatureConfig, known: dict[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Return the remaining inputs, computed row by row."""
    names = tuple(name for name in features.inputs if name not in known)
    if not names:
        return {}
    history = FeatureHistory(replace(features, inputs=names, history=1))
    rows = []
    for time in range(len(next(iter(observations.values())))):
        history.update({name: values[time][None] for name, values in observations.items()})
        if time % features.repeat == 0:
            rows.append(history.stack())
    return {name: np.concatenate([row[name] for row in rows]) for name in names}
