"""How well the fields at the sides distinguish a road user on collision course from an empty road.

python docs/experiments/target_signal.py --levels 1250 --jobs 2

Random levels with crossing and turning road users are recorded with and without the target, which is the only
difference. At the last decision at which full braking avoids the contact, a small network distinguishes the
two by the columns at the sides, the speed and the yaw rate. The table contains the area under the ROC curve
of networks that were trained on other levels: 0.5 without any signal, 1 if the target is always recognised.
"""

from argparse import ArgumentParser
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch

from lgmd_gym.agents.rules import excitation
from lgmd_gym.agents.sides import NEURONS, NUM_SIDE_FIELDS, SIDE_COLUMNS, side_cameras
from lgmd_gym.statistics.ranks import roc_area
from lgmd_gym.training.offline.episodes import RecordedEpisode, record_parallel
from lgmd_gym.training.offline.recorder import LevelRecorder

FAMILIES = (
    *("CCCscp", "CCFtap", "CMCscp", "CMFtap"),
    *("CPNA", "CPFA", "CPNCO", "CPTA", "CBNA", "CBNAO", "CBFA"),
)
HORIZON = {"near": (40, -0.7), "middle": (40, -1.5), "far": (40, -3.0)}  # height [px], pitch [degrees]
WINDOWS = (3, 12, 36)  # [frames]
FOLDS, NETWORKS, EPOCHS, BATCH_SIZE = 5, 3, 12, 64
LEAST_LEVELS = 20


def main(arguments: Sequence[str] | None = None) -> dict[str, dict[str, float]]:
    """Print the table, and return the areas by sensor and family."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--levels", type=int, default=1250)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    if options.levels < LEAST_LEVELS:
        parser.error(f"--levels must be at least {LEAST_LEVELS}, got {options.levels}")
    below = record(side_cameras(), options.levels, options.jobs)
    detectors = {"all models": range(len(NEURONS))} | {
        f"{name} only": (index,) for index, name in enumerate(NEURONS)
    }
    areas = {f"below the horizon, {name}": areas_by_family(below, used) for name, used in detectors.items()}
    rotating = record([not_derotated(channel) for channel in side_cameras()], options.levels, options.jobs)
    areas["below the horizon, not derotated"] = areas_by_family(rotating, detectors["all models"])
    horizon = record(cameras_at_the_horizon(), options.levels, options.jobs)
    areas["at the horizon, all models"] = areas_by_family(horizon, detectors["all models"])
    names = list(areas["below the horizon, all models"])
    print(f"| fields at the sides | {' | '.join(names)} |\n|{'---|' * (len(names) + 1)}")
    for sensor, values in areas.items():
        print(f"| {sensor} | {' | '.join(f'{values[name]:.2f}' for name in names)} |")
    return areas


def not_derotated(channel: dict[str, Any]) -> dict[str, Any]:
    """Return a channel along the path without derotation."""
    return channel | {"camera": channel["camera"] | {"gaze": {"kind": "path"}}}


def cameras_at_the_horizon() -> list[dict[str, Any]]:
    """Return the fields at the sides with frames 40 px high around the horizon."""
    cameras = []
    for channel in side_cameras():
        camera = channel["camera"]
        height, pitch = HORIZON[camera["name"].split("_")[0]]
        shape, mount = [height, camera["shape"][1]], camera["mount"] | {"pitch_deg": pitch}
        cameras.append(channel | {"camera": camera | {"shape": shape, "mount": mount}})
    return cameras


def record(
    cameras: list[dict[str, Any]], levels: int, jobs: int
) -> list[tuple[RecordedEpisode, RecordedEpisode]]:
    """Return the episodes of some levels, with and without the target."""
    sets = []
    for families in (FAMILIES, [f"{name}WithoutTarget" for name in FAMILIES]):
        arguments = {
            "families": families,
            "camera": cameras,
            "split": "train",
            "mount_heights": (1.0, 1.5),
            "decelerations": (4.5, 10.0),
            "config": {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}},
        }
        recorder = LevelRecorder("LGMD/RandomBraking-v0", arguments)
        sets.append([episode for (episode,) in record_parallel(recorder.record, range(levels), jobs, 25)])
    return list(zip(*sets, strict=True))


def areas_by_family(
    pairs: list[tuple[RecordedEpisode, RecordedEpisode]], detectors: Sequence[int]
) -> dict[str, float]:
    """Return the area under the ROC curve, over all levels and by family.

    Args:
        pairs: Episodes with and without the target.
        detectors: Indices in `NEURONS` of the models in use.
    """
    rows, families = [], []
    for episode, without in pairs:
        timely = np.flatnonzero(~episode.braking_contacts)
        if episode.threat and len(timely) and timely[-1] < len(without):
            rows.append([features(item, timely[-1], detectors) for item in (episode, without)])
            families.append(episode.family)
    table = np.array(rows, np.float32)  # (levels, 2, features)
    table = (table - table.mean((0, 1))) / (table.std((0, 1)) + 0.03)
    fold = np.arange(len(table)) % FOLDS
    scores = np.empty(table.shape[:2])
    for index in range(FOLDS):
        scores[fold == index] = fit_and_score(table[fold != index], table[fold == index])
    groups = {"all": np.full(len(families), True)}
    groups |= {name: np.array(families) == name for name in sorted(set(families))}
    return {name: roc_area(*scores[group].T) for name, group in groups.items()}


def features(episode: RecordedEpisode, time: int, detectors: Sequence[int]) -> np.ndarray:
    """Return the mean responses of the columns over the last frames before a decision, and the motion."""
    shape = (-1, len(NEURONS), NUM_SIDE_FIELDS * SIDE_COLUMNS)
    columns = episode.observations["column_potential"][: time + 1].astype(np.float64).reshape(shape)
    responses = excitation(columns[:, list(detectors)]).reshape(time + 1, -1)
    levels = np.copysign(np.log1p(2.0 * np.abs(responses)), responses)
    means = [levels[-count:].mean(0) for count in WINDOWS]
    motion = [episode.observations[name][time] for name in ("ego_speed", "ego_yaw_rate")]
    return np.concatenate([*means, *motion])


def fit_and_score(train: np.ndarray, test: np.ndarray) -> np.ndarray:
    """Return the log odds of a target, the mean of some networks.

    Args:
        train: Features of the levels with and without the target, (levels, 2, features).
        test: Features of other levels.
    """
    inputs = torch.from_numpy(train).flatten(0, 1)
    labels = torch.tensor([1.0, 0.0]).repeat(len(train))
    scores = []
    for seed in range(NETWORKS):
        torch.manual_seed(seed)
        network = torch.nn.Sequential(
            torch.nn.Dropout(0.2),
            torch.nn.Linear(inputs.shape[1], 64),
            torch.nn.ReLU(),
            torch.nn.Dropout(0.3),
            torch.nn.Linear(64, 1),
        )
        optimizer = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=0.3)
        for _ in range(EPOCHS):
            for batch in torch.randperm(len(inputs)).split(BATCH_SIZE):
                logits = network(inputs[batch])[:, 0]
                loss = torch.nn.functional.binary_cross_entropy_with_logits(logits, labels[batch])
                optimizer.zero_grad()
                loss.backward()
                optimizer.step()
        network.eval()
        with torch.no_grad():
            scores.append(network(torch.from_numpy(test))[..., 0].numpy())
    return np.mean(scores, axis=0)


if __name__ == "__main__":
    main()
