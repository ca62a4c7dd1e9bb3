# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Does the neuron earn its place in a policy? Networks that learn from several detectors on the same frames.

    python docs/experiments/neuron_ablation.py DATA --levels 3000 --validation 750 --seeds 3

Random levels are recorded once, in the folder DATA: the forward fields of `policy:all-round` through six
detectors, and its fields at the sides through three. Each lens is drawn once for all detectors. Then one
network per arm and seed is trained with the recipe of `policy:all-round`, without its ensemble and its
traffic, and in batches of 32 levels: the arms differ in their inputs only. Half of the validation levels
select the epoch and the margin of each network, by the highest weighted return, and the tables have the
results on the other half, with paired differences to the first arm of each group. Intervals are clustered by
world and by training. A level takes about 0.5 s of one core to record, and a training on 1,500 levels about
25 s. Recordings and results of an earlier run in DATA are used again.
"""

from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from gymnasium.utils import seeding

from lgmd_gym.agents.policies.features import CLIP, GAINS, NORM, NUM_LEVELS, FeatureConfig, weaker
from lgmd_gym.agents.rules import excitation
from lgmd_gym.agents.sides import (
    FORWARD_COLUMNS,
    NEURONS,
    NUM_FORWARD_COLUMNS,
    NUM_SIDE_FIELDS,
    SIDE_COLUMNS,
    forward_cameras,
    side_cameras,
)
from lgmd_gym.agents.zones import NUM_FIELDS
from lgmd_gym.aliases import Arguments, Observation
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.neuron import Signal
from lgmd_gym.processes.files import complete_file
from lgmd_gym.statistics.intervals import Mean, cluster_mean
from lgmd_gym.training.config import VALIDATION_SEED
from lgmd_gym.training.offline.dataset import OfflineDataset
from lgmd_gym.training.offline.episodes import (
    RecordedEpisode,
    check_file,
    is_complete,
    load,
    record_parallel,
    save,
)
from lgmd_gym.training.offline.evaluation import BATCH_SIZE
from lgmd_gym.training.offline.learner import OfflineLearner
from lgmd_gym.training.offline.recorder import LevelRecorder

DETECTORS = {
    "lgmd": "lgmd",
    "off-only": "off-only:n_ts=9,spikes_from=membrane",
    "edges": "edges",
    "dsn": "dsn",
    "|P|": "difference",
    "pixels": "neuron_ablation:MeanGrey",
}
SPIKING = ("lgmd", "off-only")
HARD = (
    *("CCRsCurve", "StandingBox", "NarrowBox", "FastCCRs", "FastCCRm", "FastCCRb", "CurvePass"),
    *("CloseBrakeRelease", "FastEmptyRoad", "FastOvertaken", "FastFollowing", "FastAdjacentPass"),
    *("FastBridgeShadow", "FastBrakeRelease", "Oncoming", "BicyclePass", "CutOut", "LeadTurnsOff"),
    *("CrossingClears", "CurveGuardRail", "CCRsCurveWithoutTarget"),
)
THREATS = (
    *("CCCscp", "CCFtap", "CCFhos", "CCFhol", "CMCscp", "CMFtap", "CPNA", "CPFA", "CPNCO", "CPLA"),
    *("CPTA", "CPRA", "CBNA", "CBNAO", "CBFA", "CBLA"),
)
TWINS = tuple(f"{name}WithoutTarget" for name in THREATS)
FILE_SIZE = 50  # levels


class MeanGrey:
    """Grey of the pixels, as a potential: (grey - 128) / 16 is the excitation."""

    signals = {"membrane_potential": Signal(0.0, 1.0)}  # noqa: RUF012

    def __init__(self, shape: tuple[int, int], fps: float, num: int) -> None:
        self.map = np.zeros((num, *shape), np.float32)

    def step(self, frames: np.ndarray, active: np.ndarray) -> dict[str, np.ndarray]:
        """Keep the frames; see `lgmd_gym.neuron.Model`."""
        self.map[active] = frames[active].astype(np.float32) - 128.0
        return {"membrane_potential": np.full(len(frames), 0.5)}

    def reset(self, mask: np.ndarray) -> None:
        """Forget the frames."""
        self.map[mask] = 0.0

    def column_map(self) -> tuple[np.ndarray, float]:
        """Return the grey and its scale."""
        return self.map, 16.0


class LevelSet(NamedTuple):
    """Levels of some families."""

    name: str
    shares: dict[str, float]  # of all levels, by split
    families: tuple[str, ...] | None  # None for the usual ones
    first: int  # seeds from here on; a threat and its twin have the same

    def seeds(self, split: str, count: int) -> range:
        """Return the seeds of the levels of a split, of `count` levels in all sets."""
        first = self.first + (VALIDATION_SEED if split == "validation" else 0)
        return range(first, first + round(self.shares[split] * count))


def _shares(training: int, validation: int) -> dict[str, float]:
    return {"train": training / 30, "validation": validation / 30}


SETS = (
    LevelSet("usual", _shares(6, 11), None, 0),
    LevelSet("hard", _shares(4, 9), HARD, 100_000),
    LevelSet("threats", _shares(10, 5), THREATS, 200_000),
    LevelSet("twins", _shares(10, 5), TWINS, 200_000),
)


def cameras() -> list[dict[str, Any]]:
    """Return the channels: the forward fields by detector, then the fields at the sides."""
    forward = [
        channel | {"name": f"{channel['camera']['name']}_{name}", "neuron": neuron}
        for name, neuron in DETECTORS.items()
        for channel in forward_cameras()
    ]
    return forward + side_cameras()


def record(folder: Path, split: str, count: int) -> None:
    """Record the missing levels of a split."""
    for levels in SETS:
        arguments: Arguments = {
            "camera": cameras(),
            "split": split,
            "mount_heights": (1.0, 1.5),
            "decelerations": (4.5, 10.0),
            "config": {"action": {"type": "DiscreteDemand", "demands": [0.0, -1.0]}},
        }
        if levels.families is not None:
            arguments["families"] = list(levels.families)
        recorder = LevelRecorder("LGMD/RandomBraking-v0", arguments)
        seeds = levels.seeds(split, count)
        for number in range(0, len(seeds), FILE_SIZE):
            part = seeds[number : number + FILE_SIZE]
            file = folder / split / levels.name / f"{number:06d}.npz"
            if is_complete(file) and check_file(file, {}) >= len(part):
                continue
            file.parent.mkdir(parents=True, exist_ok=True)
            by_seed = [
                [replace(item, observations=levels_of(item.observations)) for item in episodes]
                for episodes in record_parallel(recorder.record, part, 1, FILE_SIZE)
            ]
            save(by_seed, file, {"first": part.start, "split": split})
            print(f"{file}: {len(part)} levels", flush=True)


def levels_of(signals: Observation) -> Observation:
    """Return the levels of the detectors by name, float16, (T, columns or fields), and the ego's motion.

    Levels are those of `lgmd_gym.agents.policies.features.levels_of`; those of pixels are linear.
    """
    columns, levels = excitation(signals["column_potential"]), dict[str, np.ndarray]()
    fields, frequency = excitation(signals["membrane_potential"]), signals["spike_frequency"]
    for index, name in enumerate(DETECTORS):
        part = columns[:, index * NUM_FORWARD_COLUMNS : (index + 1) * NUM_FORWARD_COLUMNS]
        levels[name] = part / 4.0 if name == "pixels" else logarithmic(part, 2.0)
        if name in SPIKING:
            part = slice(index * NUM_FIELDS, (index + 1) * NUM_FIELDS)
            levels[f"{name} fields"] = logarithmic(fields[:, part], 2.0)
            levels[f"{name} spikes"] = logarithmic(frequency[:, part], 0.1)
    first, field = len(DETECTORS) * NUM_FORWARD_COLUMNS, len(DETECTORS) * NUM_FIELDS
    for name in NEURONS:
        size = NUM_SIDE_FIELDS * SIDE_COLUMNS
        levels[f"{name} sides"] = logarithmic(columns[:, first : first + size], 2.0)
        levels[f"{name} ffi"] = logarithmic(signals["ffi"][:, field : field + NUM_SIDE_FIELDS], 2.0)
        first, field = first + size, field + NUM_SIDE_FIELDS
    motion = {name: signals[name] for name in ("ego_speed", "ego_yaw_rate", "known_deceleration")}
    return {name: values.astype(np.float16) for name, values in levels.items()} | motion


def logarithmic(values: np.ndarray, factor: float) -> np.ndarray:
    """Return the levels of some values."""
    values = values.astype(np.float64)
    return np.copysign(np.log1p(factor * np.abs(values)), values) / NORM


class Arm(NamedTuple):
    """A selection of levels as the inputs of a network, beside the ego's motion."""

    title: str
    names: tuple[str, ...]


def _sides(*neurons: str) -> tuple[str, ...]:
    """Return the inputs of `policy:all-round`, with the fields at the sides of some detectors."""
    columns = [f"{name} sides" for name in neurons]
    return ("lgmd", *columns, *(f"{name} ffi" for name in neurons if name != "edges"))


GROUPS = {
    "forward": [Arm(name, (name,)) for name in DETECTORS],
    "sides": [
        Arm("all three", _sides(*NEURONS)),
        *(Arm(f"without {name}", _sides(*(item for item in NEURONS if item != name))) for name in NEURONS),
        Arm("no sides", ("lgmd",)),
    ],
    "fields": [
        Arm("lgmd, potential", ("lgmd fields",)),
        Arm("lgmd, spike frequency", ("lgmd spikes",)),
        Arm("off-only, potential", ("off-only fields",)),
        Arm("off-only, spike frequency", ("off-only spikes",)),
    ],
}
"""Arms by group; the first of each group is the reference of its differences."""
HEADS = {
    "forward": "170 columns of the forward fields",
    "sides": "LGMD in the forward fields; at the sides",
    "fields": "17 means of the forward fields",
}
MOTION = ("ego_speed", "ego_yaw_rate", "known_deceleration")
FEATURES = FeatureConfig(inputs=("columns", *MOTION), history=1, repeat=2, latch=True)
RECIPE: Arguments = {
    "batch_size": 32,
    "learning_rate": 0.004,
    "weight_decay": 0.1,
    "false_cost": 2.0,
    "initial_brake_probability": 0.03,
    "logit_decay": 0.0003,
    "standardise": True,
    "mirror": True,
    "select_margin": True,
    "bfloat16": True,
    "policy_kwargs": {"net_arch": {"pi": [256, 64], "vf": []}},
}


class FieldDataset(OfflineDataset):
    """Recorded levels with the features of some detectors as the input `columns`.

    Args:
        episodes: Recorded levels, with the observations of `levels_of`.
        names: Names of the detectors' levels.
    """

    def __init__(self, episodes: Sequence[RecordedEpisode], names: Sequence[str]) -> None:
        motion = [{name: item.observations[name] for name in MOTION} for item in episodes]
        super().__init__(
            [replace(item, observations=values) for item, values in zip(episodes, motion, strict=True)],
            replace(FEATURES, inputs=MOTION),
        )
        self._features = FEATURES
        self.order, self.signs = mirror_of(names)
        for inputs, item in zip(self._inputs, episodes, strict=True):
            inputs["columns"] = features_of(np.concatenate([item.observations[name] for name in names], 1))

    def _arrays(self, name: str, indices: Any, mirrored: Any) -> list[np.ndarray]:
        if name != "columns" or not len(mirrored):
            return super()._arrays(name, indices, mirrored)
        arrays = super()._arrays(name, indices, ())
        return [
            self._mirrored(array) if flag else array for array, flag in zip(arrays, mirrored, strict=True)
        ]

    def _mirrored(self, array: np.ndarray) -> np.ndarray:
        image = array[:, self.order]
        np.negative(image, out=image, where=self.signs < 0.0)
        return image


def features_of(levels: np.ndarray) -> np.ndarray:
    """Return the features of levels, (T, columns), at each decision of the policy, float16.

    They are those of `FeatureHistory`: the weaker level of the last two frames, and three averages.
    """
    values = levels.astype(np.float32)
    means = np.empty((len(values), len(GAINS), values.shape[1]), np.float32)
    mean = np.zeros(means.shape[1:], np.float32)
    for time, level in enumerate(values):
        mean = mean + GAINS.astype(np.float32) * (level - mean)
        means[time] = mean
    last = np.concatenate([values[:1], values[:-1]])
    parts = [weaker(values, last), means.reshape(len(values), -1)]
    return np.concatenate(parts, axis=1)[:: FEATURES.repeat].astype(np.float16)


def mirror_of(names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return the order and the signs of the features in the mirror image."""
    orders, signs, first = [], [], 0
    for name in names:
        size = len(_MIRRORS[name.partition(" ")[2]])
        orders.append(first + _MIRRORS[name.partition(" ")[2]])
        signs.append(np.full(size, -1.0 if name in ("dsn", "dsn sides") else 1.0, np.float16))
        first += size
    order = np.arange(NUM_LEVELS)[:, None] * first + np.concatenate(orders)
    return order.ravel(), np.tile(np.concatenate(signs), NUM_LEVELS)


_SIDE_FIELDS = np.arange(NUM_SIDE_FIELDS)
_MIRRORS = {  # by the second word of the name: index of the value that takes each place
    "": np.arange(NUM_FORWARD_COLUMNS).reshape(-1, FORWARD_COLUMNS)[:, ::-1].ravel(),
    "fields": np.arange(NUM_FIELDS),
    "spikes": np.arange(NUM_FIELDS),
    "sides": np.arange(NUM_SIDE_FIELDS * SIDE_COLUMNS).reshape(-1, 2, SIDE_COLUMNS)[:, ::-1, ::-1].ravel(),
    "ffi": _SIDE_FIELDS.reshape(-1, 2)[:, ::-1].ravel(),
}


class _Spaces(gym.Env):
    """The spaces of a policy with some features."""

    def __init__(self, num_features: int) -> None:
        sizes = {"columns": num_features} | dict.fromkeys(MOTION, 1)
        self.observation_space = spaces.Dict(
            {name: spaces.Box(-CLIP, CLIP, (size,), np.float32) for name, size in sizes.items()}
        )
        self.action_space = spaces.Discrete(2)


class Outcomes(NamedTuple):
    """Results of a deterministic policy, one per level."""

    returns: np.ndarray  # float64
    brakes: np.ndarray  # bool
    contacts: np.ndarray  # bool


def train(train_set: FieldDataset, selection: FieldDataset, seed: int, epochs: int) -> OfflineLearner:
    """Return a learner after its training."""
    env = _Spaces(len(train_set.order))
    learner = OfflineLearner("MultiInputPolicy", env, (0.0, -1.0), seed=seed, n_epochs=epochs, **RECIPE)
    learner.learn(train_set, selection)
    return learner


@torch.no_grad()
def outcomes(learner: OfflineLearner, dataset: FieldDataset) -> Outcomes:
    """Return the results of the policy on recorded levels."""
    rows: list[tuple[float, bool, bool]] = []
    for start in range(0, len(dataset), BATCH_SIZE):
        part = range(len(dataset))[start : start + BATCH_SIZE]
        batch = dataset.batch(part)
        wanted = (learner.logits(batch).numpy() > 0.0) & (batch.mask.numpy() > 0.0)
        for row, wants in enumerate(wanted):
            rewards, onset = batch.rewards[row].numpy(), int(wants.argmax())
            if wants.any():
                total = rewards[:onset].sum() + float(batch.braking_returns[row, onset])
                rows.append((total, True, bool(batch.braking_contacts[row, onset])))
            else:
                rows.append((rewards.sum(), False, bool(batch.threats[row])))
    returns, brakes, contacts = zip(*rows, strict=True)
    return Outcomes(np.array(returns), np.array(brakes), np.array(contacts))


def read(folder: Path, split: str, count: int) -> Iterator[tuple[int, RecordedEpisode]]:
    """Yield the seed and the recording of each level of a split."""
    for levels in SETS:
        seeds = iter(levels.seeds(split, count))
        for file in sorted((folder / split / levels.name).glob("*.npz")):
            for (item,), seed in zip(load(file), seeds, strict=False):  # an end of the file takes no seed
                yield seed, item


def world_of(split: str, seed: int) -> int:
    """Return the number of the world of the level that an environment plays after `reset(seed=seed)`."""
    rng, _ = seeding.np_random(seed)
    return RandomLevels(split=split).draw(rng).info["world"]


def results(
    folder: Path, sets: Sequence[Sequence[RecordedEpisode]], arm: Arm, seeds: int, epochs: int
) -> list[Outcomes]:
    """Return the results of an arm, one per training; those in the folder are not repeated.

    Args:
        folder: Folder of recordings and results.
        sets: Levels of the training, of the selection, and of the results.
        arm: The inputs.
        seeds: Number of trainings.
        epochs: Epochs of each training.
    """
    name = "+".join(arm.names).replace(" ", "_")
    folder = folder / "results" / f"{len(sets[0])}-levels-{epochs}-epochs"
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{name}-{seed}.npz" for seed in range(seeds)]
    missing = [seed for seed, file in enumerate(files) if not file.exists()]
    if missing:
        train_set, selection, report = (FieldDataset(part, arm.names) for part in sets)
        for seed in missing:
            found = outcomes(train(train_set, selection, seed, epochs), report)
            with complete_file(files[seed]) as part, part.open("wb") as out:
                np.savez(out, **found._asdict())
            print(f"{arm.title}, seed {seed}: mean return {found.returns.mean():.3f}", flush=True)
    return [Outcomes(**np.load(file)) for file in files]


class Report(NamedTuple):
    """Results of one arm over its trainings: return, share of avoided threats, and of false activations."""

    arm: Arm
    means: tuple[float, ...]
    differences: tuple[Mean, ...]  # to the first arm of the group, in the same levels and seeds; empty for it


def report_of(
    arm: Arm, found: list[Outcomes], reference: list[Outcomes], threats: np.ndarray, worlds: np.ndarray
) -> Report:
    """Return the results of an arm; the reference has none to itself.

    Args:
        arm: The arm.
        found: Results of its trainings.
        reference: Results of the trainings of the reference, for the same seeds.
        threats: Whether each level is a threat, (levels,).
        worlds: World of each level, (levels,).
    """
    levels = (np.full(len(threats), True), threats, ~threats)
    own, others = (np.array([_measures(item) for item in trainings]) for trainings in (found, reference))
    means, differences = list[float](), list[Mean]()
    for index, chosen in enumerate(levels):
        values = own[:, index, chosen]
        means.append(float(values.mean()))
        if found is not reference:
            seeds = np.repeat(np.arange(len(values)), values.shape[1])
            difference = (values - others[:, index, chosen]).ravel().tolist()
            differences.append(
                cluster_mean(difference, np.tile(worlds[chosen], len(values)).tolist(), seeds.tolist())
            )
    return Report(arm, tuple(means), tuple(differences))


def _measures(found: Outcomes) -> np.ndarray:
    return np.array([found.returns, ~found.contacts, found.brakes], np.float64)


def table(group: str, reports: Sequence[Report]) -> str:
    """Return the results of a group in Markdown."""
    heads = ("mean return", "avoided [%]", "false activations [%]")
    against = f"against {reports[0].arm.title}"
    lines = [
        f"| {HEADS[group]} | {' | '.join(heads)} | return {against} | avoided | false activations |",
        f"|---{'|---:' * 6}|",
    ]
    for report in reports:
        mean_return, *shares = report.means
        cells = [f"{mean_return:.2f}", *(f"{100.0 * share:.1f}" for share in shares)]
        if report.differences:
            first, *others = report.differences
            cells += [_difference(first, 1.0, 2), *(_difference(item, 100.0, 1) for item in others)]
        else:
            cells += ["–"] * 3
        title = report.arm.title.replace("|", r"\|")
        lines.append(f"| {title} | {' | '.join(cells)} |".replace("| -", "| −"))
    return "\n".join(lines)


def _difference(mean: Mean, factor: float, digits: int) -> str:
    assert mean.value is not None
    if mean.low is None or mean.high is None:
        return f"{factor * mean.value:+.{digits}f}"
    low, high = (f"{factor * bound:+.{digits}f}" for bound in (mean.low, mean.high))
    return f"{factor * mean.value:+.{digits}f} [{low}, {high}]".replace("-", "−")


def main(arguments: Sequence[str] | None = None) -> dict[str, list[Report]]:
    """Record, train and print the tables; return the results by group."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--levels", type=int, default=3000)
    parser.add_argument("--validation", type=int, default=750)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--epochs", type=int, default=8)
    parser.add_argument("--groups", nargs="+", choices=GROUPS, default=list(GROUPS))
    options = parser.parse_args(arguments)
    for split, count in (("train", options.levels), ("validation", options.validation)):
        record(options.folder, split, count)
    training = [item for _, item in read(options.folder, "train", options.levels)]
    validation = list(read(options.folder, "validation", options.validation))
    selection = [item for seed, item in validation if seed % 2 == 0]
    held = [(seed, item) for seed, item in validation if seed % 2 == 1]
    sets = (training, selection, [item for _, item in held])
    worlds = np.array([world_of("validation", seed) for seed, _ in held])
    threats = np.array([item.threat for _, item in held])
    print(
        f"{len(training)} training levels, {len(selection)} of selection; results on {threats.sum()} threats "
        f"and {(~threats).sum()} others in {len(np.unique(worlds))} worlds; {options.seeds} trainings"
    )
    found: dict[str, list[Report]] = {}
    for group in options.groups:
        trained = [results(options.folder, sets, arm, options.seeds, options.epochs) for arm in GROUPS[group]]
        found[group] = [
            report_of(arm, item, trained[0], threats, worlds)
            for arm, item in zip(GROUPS[group], trained, strict=True)
        ]
        print(table(group, found[group]))
    return found


if __name__ == "__main__":
    main()
