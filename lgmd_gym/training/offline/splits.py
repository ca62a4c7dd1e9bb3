"""What a training from recorded drives needs: recorded once, here or by another training."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lgmd_gym.training.config import JUDGED, SEEDS_APART, Plan
from lgmd_gym.training.offline.episodes import Drive, record
from lgmd_gym.training.offline.storage import check_file, load, origin_of, save
from lgmd_gym.training.offline.traffic import record_traffic

PART = 100  # drives in one file
TRAFFIC_JUDGED = 4  # drives through traffic of the train split for one of the validation split


@dataclass(frozen=True)
class Lot:
    """Drives of one kind that a training learns from or is judged by.

    Attributes:
        name: Of their folder.
        split: "train" or "validation".
        seeds: Each gives one level's drive, or the pieces of one drive through traffic.
        record: Records those of some seeds; as `record_traffic`.
    """

    name: str
    split: str
    seeds: range
    record: Callable[..., list[list[Drive]]]


def lots(plan: Plan, split: str) -> list[Lot]:
    """Return what a training needs of a split: levels, and traffic if the plan says so."""
    train = split == "train"
    first = SEEDS_APART * plan.seed if train else JUDGED
    count = plan.n_timesteps if train else plan.eval_episodes
    found = [Lot(split, split, range(first, first + count), _record_levels)]
    if plan.traffic:
        # Others than the suite's, which begin at 0.
        first = SEEDS_APART * (plan.seed + 1) if train else JUDGED
        count = plan.traffic if train else -(-plan.traffic // TRAFFIC_JUDGED)
        found.append(Lot(f"traffic-{split}", split, range(first, first + count), record_traffic))
    return found


def _record_levels(*arguments: Any) -> list[list[Drive]]:
    return [[drive] for drive in record(*arguments)]


def drives_of(plan: Plan, split: str, folder: Path, progress: bool, jobs: int) -> list[Drive]:
    """Return the drives of a training: of another's folder if the plan says so, else its own.

    Its own are recorded once and kept in its folder, a hundred in a file, so that an interrupted recording
    goes on from there.

    Args:
        plan: Of the training.
        split: "train" or "validation".
        folder: Of the training.
        progress: Whether to show it on stderr.
        jobs: Processes that record.
    """
    drives: list[Drive] = []
    for lot in lots(plan, split):
        kept = Path(plan.drives or folder) / "drives" / lot.name
        if plan.drives is None:
            _record_missing(plan, lot, kept, progress, jobs)
        by_seed: list[list[Drive]] = []
        for file in sorted(kept.glob("*.npz")):
            if len(by_seed) < len(lot.seeds):
                by_seed += load(file)[0]
        drives += [drive for some in by_seed[: len(lot.seeds)] for drive in some]
    return drives


def check_drives(plan: Plan) -> None:
    """Refuse another training's drives that will not do, before anything is done.

    Raises:
        ValueError: If they are none, too few, or were recorded with another eye or environment.
    """
    if plan.drives is None:
        return
    for lot in (*lots(plan, "train"), *lots(plan, "validation")):
        kept = Path(plan.drives) / "drives" / lot.name
        count = sum(check_file(file, origin_of(plan)) for file in sorted(kept.glob("*.npz")))
        if count == 0:
            option = "" if lot.name == lot.split else f" --traffic {plan.traffic}"
            once = f"train once with --algo recorded{option}, without --drives"
            raise ValueError(f"no recorded drives in {str(kept)!r}; {once}")
        if count < len(lot.seeds):
            raise ValueError(
                f"{str(kept)!r} holds {count} drives, {len(lot.seeds)} are wanted; ask for fewer"
            )


def _record_missing(plan: Plan, lot: Lot, kept: Path, progress: bool, jobs: int) -> None:
    from tqdm import tqdm

    kept.mkdir(parents=True, exist_ok=True)
    bar = tqdm(total=len(lot.seeds), desc=f"recording {lot.name}", unit="drive", disable=not progress)
    with bar:
        for start in range(0, len(lot.seeds), PART):
            seeds, file = lot.seeds[start : start + PART], kept / f"{start:06d}.npz"
            if file.exists():
                bar.update(len(seeds))
            else:
                save(lot.record(plan, lot.split, seeds, jobs, bar.update), file, origin_of(plan))
