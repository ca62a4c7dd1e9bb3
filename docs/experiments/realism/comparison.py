"""Comparison of simulated drives with real clips, statistic by statistic."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np
from drive_statistics import STATISTICS, drive_statistics
from drives import GROUPS, Drives, Optics, drive_frames

from lgmd_gym.clips import VideoReader, luma
from lgmd_gym.clips.batch import ClipJob
from lgmd_gym.errors import check_keys

NIGHT_MEDIAN = 75  # median grey below which a clip counts as night, unless clips are named
RANGE = (5.0, 95.0)  # percentiles of the simulated values between which a real value counts as inside


class DriveValues(NamedTuple):
    """Statistics of one drive.

    Attributes:
        name: Name of the clip, or environment, arguments and seed.
        group: "day" or "night".
        real: Whether the drive is a real clip.
        values: Values by key of `STATISTICS`.
    """

    name: str
    group: str
    real: bool
    values: dict[str, float]


class Comparison(NamedTuple):
    """One statistic of the real and the simulated drives of a group.

    Attributes:
        group: "day" or "night".
        statistic: Key of `STATISTICS`.
        real: Values of the real clips, ascending, shape (n,).
        simulated: Values of the simulated drives, ascending, shape (m,).
        low: 5th percentile of the simulated values.
        high: 95th percentile of the simulated values.
        inside: Number of real values in [low, high].
        median_inside: Whether the median of the real values is in [low, high].
        distance: See `normalized_distance`.
    """

    group: str
    statistic: str
    real: np.ndarray
    simulated: np.ndarray
    low: float
    high: float
    inside: int
    median_inside: bool
    distance: float


def common_optics(jobs: Sequence[ClipJob], hfov_deg: float, ignored_bottom: float = 0.0) -> Optics:
    """Return the most frequent frame size and the most frequent rate of clips, in whole Hz.

    Args:
        jobs: The clips.
        hfov_deg: Horizontal field of view of the clips [degrees].
        ignored_bottom: See `Optics`.
    """
    readers = [VideoReader(job.clip) for job in jobs]
    shapes = Counter(next(iter(reader)).shape[:2] for reader in readers)
    rates = Counter(max(round(reader.fps), 1) for reader in readers)
    height, width = shapes.most_common(1)[0][0]
    return Optics((height, width), rates.most_common(1)[0][0], hfov_deg, ignored_bottom)


def clip_values(
    jobs: Sequence[ClipJob], optics: Optics, night: Sequence[str] | None, on_step: Callable[[], object]
) -> list[DriveValues]:
    """Return the statistics of real clips, from their frames before the crash.

    Clips of another size are scaled; each clip keeps its frame rate.

    Args:
        jobs: The clips, each with its crash frame or None.
        optics: Size and field of view of the frames.
        night: Names of the clips at night, with or without suffix; None to classify a clip by the median grey
            of its whole frames, night below 75.
        on_step: Function called after each clip.

    Raises:
        ValueError: For an unknown name, or a clip that is too short.
    """
    if night is not None:
        check_keys("clip", night, {name for job in jobs for name in (job.clip.name, job.clip.stem)})
    results = []
    for job in jobs:
        height, width = optics.shape
        reader = VideoReader(job.clip, size=(width, height))
        greys = np.zeros(256, np.int64)
        try:
            values = drive_statistics(_frames(reader, job.crash_frame, greys), reader.fps, optics)
        except ValueError as error:
            raise ValueError(f"clip {job.clip.name}: {error}") from None
        named = night is not None and not {job.clip.name, job.clip.stem}.isdisjoint(night)
        dark = named if night is not None else 2 * greys[:NIGHT_MEDIAN].sum() >= greys.sum()
        results.append(DriveValues(job.clip.name, "night" if dark else "day", True, values))
        on_step()
    return results


def _frames(reader: VideoReader, stop: int | None, greys: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the grey frames of a clip before the frame `stop` and add their pixels to a histogram."""
    for picture in islice(reader, stop):
        frame = luma(picture)
        greys += np.bincount(frame.reshape(-1), minlength=256)
        yield frame


def simulated_values(
    drives: Sequence[Drives], optics: Optics, on_step: Callable[[], object]
) -> list[DriveValues]:
    """Return the statistics of simulated drives.

    Args:
        drives: The drives.
        optics: Size, rate and field of view of the frames.
        on_step: Function called after each drive.
    """
    results = []
    for item in drives:
        for seed in item.seeds:
            values = drive_statistics(drive_frames(item, seed, optics), optics.fps, optics)
            results.append(DriveValues(f"{item.label} seed={seed}", item.group, False, values))
            on_step()
    return results


def compare(drives: Sequence[DriveValues]) -> list[Comparison]:
    """Return one comparison per statistic and group that has real and simulated drives.

    A value that is NaN, such as the excitation of a field that no frame covers, is left out.
    """
    comparisons = []
    for group in GROUPS:
        for name in STATISTICS:
            real, simulated = (
                np.sort(
                    [v for d in drives if (d.group, d.real) == (group, kind) and (v := d.values[name]) == v]
                )
                for kind in (True, False)
            )
            if len(real) and len(simulated):
                low, high = np.percentile(simulated, RANGE)
                inside = int(((real >= low) & (real <= high)).sum())
                comparisons.append(
                    Comparison(
                        group, name, real, simulated, float(low), float(high), inside,
                        bool(low <= np.median(real) <= high), normalized_distance(real, simulated),
                    )
                )  # fmt: skip
    return comparisons


def normalized_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the Wasserstein-1 distance of two samples, divided by the range of all values.

    0 for equal samples, 1 for two different constants.
    """
    values = np.sort(np.concatenate([one, other]))
    if values[-1] == values[0]:
        return 0.0
    shares = [np.searchsorted(np.sort(sample), values[:-1], "right") / len(sample) for sample in (one, other)]
    area = float((np.abs(shares[0] - shares[1]) * np.diff(values)).sum())
    return area / float(values[-1] - values[0])
