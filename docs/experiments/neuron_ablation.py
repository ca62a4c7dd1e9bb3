# pyright: standard
# Not strict: torch and stable-baselines3 state few types.
"""Does the neuron earn its place in a policy? Networks that learn from several detectors on the same frames.

    python docs/experiments/neuron_ablation.py DATA --levels 3000 --validation 750 --seeds 3

Random levels are recorded once, in the folder DATA: the forward fields of `policy:all-round` through six
detectors, and its fields at the sides through three. Each lens is drawn once for all detectors. A driver
brakes at random in the training levels, and never in the validation levels. Then one network per arm and seed
learns the time to brake from random weights, with the levels of `policy:all-round`, but without its
traffic, error levels and loss of episodes: the arms differ in their inputs only. Half of the validation
levels select the epoch and the margin of each network, and the tables have the results on the other half,
with paired differences to the first arm of each group. Intervals are clustered by world and by training.

A network brakes at the first decision whose log odds of a time to brake below 0.6 s exceed its margin, which
is exceeded in one of ten selection levels without a threat. So the arms are compared at about the same rate
of false activations, and no weight of an error is chosen. A threat is avoided if that decision has a time to
brake above 0. Braking that is much too early counts as avoided, too; the area under the ROC curve, of all
margins, has the same limit. Recordings and results of an earlier run in DATA are used again.
"""

import json
from argparse import ArgumentParser
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding

import lgmd_gym
from lgmd_gym.agents.policies.evidence import TimeToBrakeParams
from lgmd_gym.agents.policies.features import CLIP, GAINS, NORM, NUM_LEVELS, FeatureConfig
from lgmd_gym.agents.rules import excitation
from lgmd_gym.agents.sides import (
    FORWARD_COLUMNS,
    FORWARD_NEURON,
    NEURONS,
    NUM_FORWARD_COLUMNS,
    NUM_FORWARD_FIELDS,
    NUM_SIDE_FIELDS,
    SIDE_COLUMNS,
    forward_cameras,
    side_cameras,
)
from lgmd_gym.aliases import Observation, Values
from lgmd_gym.envs.episode_source import RandomLevels
from lgmd_gym.neuron import Signal
from lgmd_gym.processes.files import complete_file
from lgmd_gym.statistics.intervals import Mean, cluster_mean
from lgmd_gym.statistics.ranks import roc_area
from lgmd_gym.training.config import VALIDATION_SEED, ExtraEpisodes, TrainConfig, parse_levels
from lgmd_gym.training.offline.dataset import StateDataset
from lgmd_gym.training.offline.driving import DriveRecorder
from lgmd_gym.training.offline.episodes import DrivenEpisode, check_file, is_complete, load, save
from lgmd_gym.training.offline.time_to_brake import TimeToBrakeLearner

DETECTORS = {
    "lgmd": "lgmd",
    "off-only": "off-only:n_ts=9,spikes_from=membrane",
    "edges": "edges",
    "dsn": "dsn",
    "|P|": "difference",
    "pixels": "neuron_ablation:MeanGrey",
}
SPIKING = ("lgmd", "off-only")
SIDE_DETECTORS = ("lgmd", *NEURONS)
FILE = Path(str(files("lgmd_gym.training") / "all-round.yml"))
CONFIG = TrainConfig.from_hyperparams("time-to-brake", file=FILE)
"""Training of `policy:all-round`."""
FROM_RANDOM = {
    "learning_rate": 0.004,
    "batch_size": 1024,
    "start_share": 0.0,
    "episode_weight": 0.0,
    "warning_weight": 0.0,
}
"""Changes for a training that starts from random weights."""
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


def level_sets(split: str, count: int) -> list[tuple[str, list[str], range]]:
    """Return the name, the families (empty for the usual ones) and the seeds of each set of levels.

    The shares are those of the usual and extra levels of `policy:all-round`. Crossing threats and the same
    levels without their target have the same seeds. So do everyday threats, but `SecondThreat` has no variant
    without its target: about three quarters of the seeds draw the same family in both sets.
    """
    sets = [ExtraEpisodes(CONFIG.n_timesteps, ()), *map(parse_levels, CONFIG.extra_levels)]
    share = count / sum(item.count for item in sets)
    first = VALIDATION_SEED if split == "validation" else 0
    return [
        (f"set{index}", list(item.names), range(first, first + round(share * item.count)))
        for index, item in enumerate(sets)
    ]


def cameras() -> list[dict[str, Any]]:
    """Return the channels: the forward fields by detector, then the sides by `SIDE_DETECTORS`."""
    others = [(name, neuron, channel) for name, neuron in DETECTORS.items() for channel in forward_cameras()]
    others += [("lgmd", "lgmd", channel) for channel in side_cameras()[:NUM_SIDE_FIELDS]]
    made = [
        channel | {"name": f"{channel['camera']['name']}_{name}", "neuron": neuron}
        for name, neuron, channel in others
    ]
    return made + side_cameras()


def record(folder: Path, split: str, count: int) -> None:
    """Record the missing levels of a split."""
    for name, families, seeds in level_sets(split, count):
        arguments = CONFIG.env_kwargs | {"camera": cameras(), "split": split}
        if families:
            arguments["families"] = families
        recorder = DriveRecorder("LGMD/RandomBraking-v0", arguments, brakes=split == "train")
        origin = origin_of(split, families)
        for number in range(0, len(seeds), FILE_SIZE):
            part = seeds[number : number + FILE_SIZE]
            file = folder / split / name / f"{number:06d}.npz"
            if is_complete(file) and check_file(file, origin) >= len(part):
                continue
            file.parent.mkdir(parents=True, exist_ok=True)
            by_seed = [[with_levels(item) for item in episodes] for episodes in recorder.record(part)]
            save(by_seed, file, origin)
            print(f"{file}: {len(part)} levels", flush=True)


def origin_of(split: str, families: Sequence[str]) -> Values:
    """Return the settings that the recorded levels of a set depend on, as plain values."""
    origin: Values = {"lgmd_gym": lgmd_gym.__version__, "split": split, "brakes": split == "train"}
    origin |= {"families": families, "env_kwargs": CONFIG.env_kwargs, "camera": cameras()}
    return json.loads(json.dumps(origin))  # lists in place of tuples


def with_levels(episode: DrivenEpisode) -> DrivenEpisode:
    """Return an episode with `levels_of` its observations; it is a threat if it ends in a contact."""
    threat = bool(episode.time_to_brake[-1] == 0.0)
    return replace(episode, observations=levels_of(episode.observations), threat=threat)


def levels_of(signals: Observation) -> Observation:
    """Return the levels of the detectors by name, float16, (T, columns or fields), and the ego's motion.

    Levels are those of `FeatureHistory`; those of pixels are linear.
    """
    columns, levels = excitation(signals["column_potential"]), dict[str, np.ndarray]()
    fields, frequency = excitation(signals["membrane_potential"]), signals["spike_frequency"]
    for index, name in enumerate(DETECTORS):
        part = columns[:, index * NUM_FORWARD_COLUMNS : (index + 1) * NUM_FORWARD_COLUMNS]
        levels[name] = part / 4.0 if name == "pixels" else logarithmic(part, 2.0)
        if name in SPIKING:
            part = slice(index * NUM_FORWARD_FIELDS, (index + 1) * NUM_FORWARD_FIELDS)
            levels[f"{name} fields"] = logarithmic(fields[:, part], 2.0)
            levels[f"{name} spikes"] = logarithmic(frequency[:, part], 0.1)
    first, field = len(DETECTORS) * NUM_FORWARD_COLUMNS, len(DETECTORS) * NUM_FORWARD_FIELDS
    for name in SIDE_DETECTORS:
        size = NUM_SIDE_FIELDS * SIDE_COLUMNS
        levels[f"{name} sides"] = logarithmic(columns[:, first : first + size], 2.0)
        levels[f"{name} ffi"] = logarithmic(signals["ffi"][:, field : field + NUM_SIDE_FIELDS], 2.0)
        first, field = first + size, field + NUM_SIDE_FIELDS
    motion = {name: signals[name] for name in MOTION}
    return {name: values.astype(np.float16) for name, values in levels.items()} | motion


def logarithmic(values: np.ndarray, factor: float) -> np.ndarray:
    """Return the levels of some values."""
    values = values.astype(np.float64)
    return np.copysign(np.log1p(factor * np.abs(values)), values) / NORM


def _sides(*neurons: str) -> tuple[str, ...]:
    """Return the inputs of `policy:all-round`, with the fields at the sides of some detectors."""
    columns = [f"{name} sides" for name in neurons]
    return (FORWARD_NEURON, *columns, *(f"{name} ffi" for name in neurons if name != "edges"))


GROUPS = {
    "forward": {name: (name,) for name in DETECTORS},
    "sides": {
        " and ".join(NEURONS): _sides(*NEURONS),
        **{f"without {name}": _sides(*(item for item in NEURONS if item != name)) for name in NEURONS},
        "with lgmd": _sides(*SIDE_DETECTORS),
        "no sides": _sides(),
    },
    "fields": {
        f"{name}, {title}": (f"{name} {kind}",)
        for name in SPIKING
        for title, kind in (("potential", "fields"), ("spike frequency", "spikes"))
    },
}
"""Names of the levels of each arm, by group and title; the first arm is the reference of the differences."""
HEADS = {
    "forward": f"{NUM_FORWARD_COLUMNS} columns of the forward fields",
    "sides": f"{FORWARD_NEURON} in the forward fields; at the sides",
    "fields": f"{NUM_FORWARD_FIELDS} means of the forward fields",
}
MOTION = ("ego_acceleration", "ego_speed", "ego_yaw_rate", "known_deceleration")
FEATURES = FeatureConfig(inputs=MOTION, history=1, repeat=2)
FALSE = 0.1  # share of the selection levels without a threat in which a network brakes


class FieldDataset(StateDataset):
    """Decisions of recorded levels with the features of some detectors as the input `columns`.

    Args:
        episodes: Recorded levels, with the observations of `levels_of`.
        names: Names of the detectors' levels.

    Attributes:
        bounds: First decision of each level, and the number of decisions, int64, (levels + 1,).
    """

    def __init__(self, episodes: Sequence[DrivenEpisode], names: Sequence[str]) -> None:
        motion = ({name: item.observations[name] for name in MOTION} for item in episodes)
        driven = (replace(item, observations=part) for item, part in zip(episodes, motion, strict=True))
        super().__init__(driven, FEATURES, TimeToBrakeParams().limits_s)
        levels = (np.concatenate([item.observations[name] for name in names], 1) for item in episodes)
        columns = [features_of(values) for values in levels]
        self.bounds = np.cumsum([0, *map(len, columns)])
        self.names, self.sizes = ["columns", *self.names], [columns[0].shape[1], *self.sizes]
        self.features = np.concatenate([np.concatenate(columns), self.features], axis=1)
        self._order, self._signs = mirror_of(names)

    def mirror(self, name: str, values: np.ndarray) -> np.ndarray:
        """Return the mirror image of an input; see `StateDataset.mirror`."""
        return values[:, self._order] * self._signs if name == "columns" else super().mirror(name, values)


def features_of(levels: np.ndarray) -> np.ndarray:
    """Return the features of levels, (T, columns), at each decision of the policy, float16.

    They are those of `FeatureHistory`: the weaker level of the last two frames, and three averages.
    """
    values = levels.astype(np.float32)
    means = np.empty((len(values), len(GAINS), values.shape[1]), np.float32)
    mean = np.zeros(means.shape[1:], np.float32)
    for time, level in enumerate(values):
        mean = mean + np.maximum(GAINS, 1.0 / (1 + time)).astype(np.float32) * (level - mean)
        means[time] = mean
    last = np.concatenate([values[:1], values[:-1]])
    weaker = np.where(np.abs(values) <= np.abs(last), values, last)
    parts = [weaker, means.reshape(len(values), -1)]
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


_MIRRORS = {  # by the second word of the name: index of the value that takes each place
    "": np.arange(NUM_FORWARD_COLUMNS).reshape(-1, FORWARD_COLUMNS)[:, ::-1].ravel(),
    "fields": np.arange(NUM_FORWARD_FIELDS),
    "spikes": np.arange(NUM_FORWARD_FIELDS),
    "sides": np.arange(NUM_SIDE_FIELDS * SIDE_COLUMNS).reshape(-1, 2, SIDE_COLUMNS)[:, ::-1, ::-1].ravel(),
    "ffi": np.arange(NUM_SIDE_FIELDS).reshape(-1, 2)[:, ::-1].ravel(),
}


class Outcomes(NamedTuple):
    """Results of a network."""

    margin: float  # log odds above which it brakes
    # highest log odds of each level, float64, (levels,): of a threat, of those before the last moment
    scores: np.ndarray


def train(train_set: FieldDataset, selection: FieldDataset, seed: int, epochs: int) -> TimeToBrakeLearner:
    """Return a learner after its training."""
    sizes = zip(train_set.names, train_set.sizes, strict=True)
    boxes: Any = {name: spaces.Box(-CLIP, CLIP, (size,), np.float32) for name, size in sizes}
    env: Any = SimpleNamespace(observation_space=spaces.Dict(boxes))
    recipe: Any = CONFIG.algo_kwargs | FROM_RANDOM | {"n_epochs": epochs, "bfloat16": False}
    learner = TimeToBrakeLearner(CONFIG.policy, env, seed=seed, **recipe)
    learner.learn(train_set, selection)
    return learner


def scores_of(
    learner: TimeToBrakeLearner, dataset: FieldDataset, episodes: Sequence[DrivenEpisode]
) -> np.ndarray:
    """Return the scores of levels without braking, see `Outcomes`.

    A network brakes in time with a margin below the score, because the decisions in time are the first ones.
    A threat without such a decision has the score -inf.
    """
    whole, scores = learner.odds(dataset), list[float]()
    limit = learner.brake.limits_s.index(learner.brake.full_s)
    for item, (first, last) in zip(episodes, pairwise(dataset.bounds), strict=True):
        odds = whole[first:last, limit]
        if item.threat:
            odds = odds[item.time_to_brake[:: FEATURES.repeat] > 0.0]
        scores.append(float(odds.max(initial=-np.inf)))
    return np.array(scores)


def read(folder: Path, split: str, count: int) -> Iterator[tuple[int, DrivenEpisode]]:
    """Yield the seed and the recording of each level of a split."""
    for name, _, seeds in level_sets(split, count):
        numbers = iter(seeds)
        for file in sorted((folder / split / name).glob("*.npz")):
            for (item,), seed in zip(load(file), numbers, strict=False):  # an end of the file takes no seed
                yield seed, item


def world_of(split: str, seed: int) -> int:
    """Return the number of the world of the level that an environment plays after `reset(seed=seed)`."""
    rng, _ = seeding.np_random(seed)
    return RandomLevels(split=split).draw(rng).info["world"]


def results(
    folder: Path, sets: Sequence[Sequence[DrivenEpisode]], names: Sequence[str], seeds: int, epochs: int
) -> list[Outcomes]:
    """Return the results of an arm, one per training; those in the folder of as many levels are kept.

    Args:
        folder: Folder of recordings and results.
        sets: Levels of the training, of the selection, and of the results.
        names: Names of the detectors' levels.
        seeds: Number of trainings.
        epochs: Epochs of each training.
    """
    name = "+".join(names).replace(" ", "_")
    levels, validation = len(sets[0]), len(sets[1]) + len(sets[2])
    folder = folder / "results" / f"{levels}-levels-{validation}-validation-{epochs}-epochs"
    folder.mkdir(parents=True, exist_ok=True)
    files = [folder / f"{name}-{seed}.npz" for seed in range(seeds)]
    missing = [seed for seed, file in enumerate(files) if not file.exists()]
    if missing:
        train_set, selection, report = (FieldDataset(part, names) for part in sets)
        for seed in missing:
            learner = train(train_set, selection, seed, epochs)
            scores = scores_of(learner, selection, sets[1])
            margin = float(np.quantile(scores[[not item.threat for item in sets[1]]], 1.0 - FALSE))
            found = Outcomes(margin, scores_of(learner, report, sets[2]))
            with complete_file(files[seed]) as part, part.open("wb") as out:
                np.savez(out, **found._asdict())
            print(f"{name}, seed {seed}: margin {margin:.2f}", flush=True)
    return [Outcomes(**np.load(file)) for file in files]


class Report(NamedTuple):
    """Results of one arm over its trainings."""

    title: str
    means: tuple[float, float]  # shares of avoided threats and of false activations
    area: float  # mean area under the ROC curve
    differences: tuple[Mean, ...]  # to the first arm of the group, in the same levels and seeds; empty for it


def report_of(
    title: str, found: list[Outcomes], reference: list[Outcomes], threats: np.ndarray, worlds: np.ndarray
) -> Report:
    """Return the results of an arm; the reference has none to itself.

    Args:
        title: Title of the arm.
        found: Results of its trainings.
        reference: Results of the trainings of the reference, for the same seeds.
        threats: Whether each level is a threat, (levels,).
        worlds: World of each level, (levels,).
    """
    own, others = (np.array([item.scores > item.margin for item in runs]) for runs in (found, reference))
    means, differences = list[float](), list[Mean]()
    for chosen in (threats, ~threats):
        values = own[:, chosen].astype(float)
        means.append(float(values.mean()))
        if found is not reference:
            seeds, places = np.indices(values.shape)
            labels = worlds[chosen][places].ravel().tolist(), seeds.ravel().tolist()
            differences.append(cluster_mean((values - others[:, chosen]).ravel().tolist(), *labels))
    areas = [roc_area(item.scores[threats], item.scores[~threats]) for item in found]
    return Report(title, (means[0], means[1]), float(np.mean(areas)), tuple(differences))


def table(group: str, reports: Sequence[Report]) -> str:
    """Return the results of a group in Markdown."""
    lines = [
        f"| {HEADS[group]} | avoided [%] | false activations [%] | area | avoided against {reports[0].title} "
        "| false activations |",
        f"|---{'|---:' * 5}|",
    ]
    for report in reports:
        cells = [report.title.replace("|", r"\|"), *(f"{100.0 * share:.1f}" for share in report.means)]
        cells += [f"{report.area:.3f}", *map(_difference, report.differences)]
        lines.append(f"| {' | '.join(cells + ['–'] * (6 - len(cells)))} |")
    return "\n".join(lines)


def _difference(mean: Mean) -> str:
    """Return a difference of shares in points with its interval."""
    assert mean.value is not None
    text = f"{100.0 * mean.value:+.1f}"
    if mean.low is not None and mean.high is not None:
        text += f" [{100.0 * mean.low:+.1f}, {100.0 * mean.high:+.1f}]"
    return text.replace("-", "−")


def main(arguments: Sequence[str] | None = None) -> dict[str, list[Report]]:
    """Record, train and print the tables; return the results by group."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    for name, default in {"levels": 3000, "validation": 750, "seeds": 3, "epochs": 6}.items():
        parser.add_argument(f"--{name}", type=int, default=default)
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
    threats = np.array([item.threat for item in sets[2]])
    print(
        f"{len(training)} training levels, {len(selection)} of selection; results on {threats.sum()} threats "
        f"and {(~threats).sum()} others in {len(np.unique(worlds))} worlds; {options.seeds} trainings"
    )
    found: dict[str, list[Report]] = {}
    for group in options.groups:
        trained = [
            results(options.folder, sets, names, options.seeds, options.epochs)
            for names in GROUPS[group].values()
        ]
        found[group] = [
            report_of(title, item, trained[0], threats, worlds)
            for title, item in zip(GROUPS[group], trained, strict=True)
        ]
        print(table(group, found[group]))
    return found


if __name__ == "__main__":
    main()
