# pyright: standard
# Not strict: joblib states few types.
"""Gradient-free fit of neuron parameters to annotated clips, with leave-one-clip-out.

The same proposals are evaluated on every clip: the parameters at the start and a Latin hypercube. The value
of a proposal on some clips is the share of crashes with an alarm onset in the window before them, early
enough to be of use, minus the cost of false alarms times the share of earlier frames in alarm; see
`lgmd_gym.clips.detection`. For each clip, the best proposal on all other clips is evaluated on that clip.
Because no proposal depends on a clip, these outcomes estimate the value on new clips of the same kind; the
value of the final proposal on the clips that chose it does not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from joblib import delayed

from lgmd_gym.aliases import Values
from lgmd_gym.clips.batch import ClipJob
from lgmd_gym.clips.detection import WINDOW_S, ClipDetection, detect
from lgmd_gym.clips.playback import DuplicateFilter, PlaybackConfig
from lgmd_gym.clips.video import VideoReader, luma
from lgmd_gym.engine.first_use import compile_kernels
from lgmd_gym.errors import check_known, check_whole, check_within
from lgmd_gym.neuron import LGMD, LGMDParams
from lgmd_gym.processes.pool import run_parallel
from lgmd_gym.tuning.space import neuron_defaults, neuron_range

MAX_TRIALS = 100_000
LEAD_S = 0.3  # shortest lead time of a hit: later alarms leave no time to brake


@dataclass(frozen=True, slots=True)
class ClipsValue:
    """Performance of proposals on some clips."""

    hits: int  # crashes with an onset in the window before them, at least the shortest lead time before them
    crashes: int  # clips with a crash
    alarm_frames: int  # frames in alarm before the windows, and in clips without a crash
    frames: int  # all such frames

    @classmethod
    def of(cls, detections: Sequence[ClipDetection], lead_s: float = LEAD_S) -> "ClipsValue":
        """Return the value of one detection per clip; hits need a lead time of at least `lead_s` [s]."""
        return cls(
            sum(item.lead_s is not None and item.lead_s >= lead_s for item in detections),
            sum(item.crash_s is not None for item in detections),
            sum(item.alarm_frames.k for item in detections),
            sum(item.alarm_frames.n for item in detections),
        )

    def total(self, false_cost: float) -> float:
        """Return what the fit maximises: share of hits − false_cost · share of earlier frames in alarm."""
        return self.hits / max(self.crashes, 1) - false_cost * self.alarm_frames / max(self.frames, 1)


@dataclass(frozen=True, slots=True)
class ClipsFit:
    """Result of `fit_clips`; the sequences have one entry per clip, in the order of the clips."""

    best: LGMDParams  # parameters with the highest value on all clips
    default: tuple[ClipDetection, ...]  # detections with the parameters of the configuration
    fitted: tuple[ClipDetection, ...]  # detections with `best`, on the clips that chose it
    left_out: tuple[ClipDetection, ...]  # detection in each clip with the best parameters of the other clips
    chosen: tuple[LGMDParams, ...]  # these parameters


def fit_clips(
    jobs: Sequence[ClipJob],
    names: Sequence[str],
    trials: int,
    config: PlaybackConfig,
    false_cost: float = 1.0,
    lead_s: float = LEAD_S,
    seed: int = 0,
    processes: int = 1,
) -> ClipsFit:
    """Fit neuron parameters to annotated clips.

    Args:
        jobs: Annotated clips, at least two of them with a crash.
        names: Names of the parameters, see `neuron_defaults`.
        trials: Number of proposals in addition to the parameters of `config`.
        config: Parameters of the first proposal, frame rate, size and duplicate filter.
        false_cost: Cost of an alarm throughout the earlier frames, relative to a missed crash.
        lead_s: Shortest lead time of a hit [s], in [0, 1.5].
        seed: Seed of the proposals.
        processes: Number of processes, which share the clips. Each holds the grey frames of one clip.

    Raises:
        ValueError: For an unknown name, no name, or fewer than two crashes.
    """
    if not names:
        raise ValueError("no neuron parameter to fit; name some, for example --neuron sigma_3 t_sp t_de")
    for name in names:
        check_known("neuron parameter", name, neuron_defaults())
    check_whole("trials", trials, 1, MAX_TRIALS)
    check_within("lead_s", lead_s, 0.0, WINDOW_S, "s")
    if sum(job.crash_frame is not None for job in jobs) < 2:
        raise ValueError(
            f"leave-one-clip-out needs at least 2 clips with a crash, got "
            f"{sum(job.crash_frame is not None for job in jobs)} of {len(jobs)}; pass more annotated clips"
        )
    proposals = [config.params, *propose(config.params, names, trials, seed)]
    compile_kernels()
    calls = (delayed(detections)(job, config, proposals) for job in jobs)
    table = list(run_parallel(calls, processes))  # table[clip][proposal]

    def best_without(left_out: int | None) -> int:
        clips = [row for number, row in enumerate(table) if number != left_out]
        values = [ClipsValue.of([row[i] for row in clips], lead_s) for i in range(len(proposals))]
        return int(np.argmax([value.total(false_cost) for value in values]))  # the first of equal ones

    best, chosen = best_without(None), [best_without(number) for number in range(len(table))]
    return ClipsFit(
        proposals[best],
        tuple(row[0] for row in table),
        tuple(row[best] for row in table),
        tuple(row[index] for row, index in zip(table, chosen, strict=True)),
        tuple(proposals[index] for index in chosen),
    )


def propose(start: LGMDParams, names: Sequence[str], trials: int, seed: int) -> list[LGMDParams]:
    """Return a Latin hypercube of parameters, each uniform in the logarithm over its `neuron_range`."""
    rng, columns = np.random.default_rng([13, seed]), {}
    for name in names:
        low, high = neuron_range(name)
        share = (rng.permutation(trials) + rng.random(trials)) / trials
        columns[name] = low * (high / low) ** share
    rows: list[Values] = [{name: float(columns[name][i]) for name in names} for i in range(trials)]
    return [LGMDParams.make(start, **row) for row in rows]


def detections(job: ClipJob, config: PlaybackConfig, proposals: Sequence[LGMDParams]) -> list[ClipDetection]:
    """Return the detection in one clip with each of the parameters."""
    reader = VideoReader(job.clip, config.fps, config.size)
    frames = [luma(picture) for picture in reader]
    duplicates = DuplicateFilter(config.drop_duplicates)
    skipped = [duplicates.is_duplicate(frame) for frame in frames]
    found: list[ClipDetection] = []
    for params in proposals:
        neuron, frequency = LGMD(frames[0].shape, reader.fps, params, roi=config.roi), []
        for frame, skip in zip(frames, skipped, strict=True):
            frequency.append(frequency[-1] if skip else neuron.step(frame).spike_frequency)
        alarm = np.array(frequency) >= params.t_sf
        found.append(detect(job.clip.stem, frequency, alarm, reader.fps, job.crash_s))
    return found
