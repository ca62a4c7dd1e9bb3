"""What a camera sees of the target at the last time at which full braking avoids the contact, by family.

    python docs/experiments/frontier.py --suites ncap2026 --to frontier.png

Prints a table in Markdown, medians over the cases of a family, and draws its figure. Angles do not depend on
the camera; pixels, contrast and visibility are those of `--camera`. A target is inside a camera if its centre
is within the field of view.
"""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path
from statistics import median

from joblib import Parallel, delayed

from lgmd_gym.benchmark.frontier import Frontier, frontier
from lgmd_gym.benchmark.suites import find_suite
from lgmd_gym.camera import CameraParams
from lgmd_gym.plotting.style import saved_figure

COLUMNS: tuple[tuple[str, Callable[[Frontier], float], str], ...] = (
    ("time left [s]", lambda item: item.time_left, "{:.2f}"),
    ("distance [m]", lambda item: item.view.distance, "{:.1f}"),
    ("bearing [°]", lambda item: abs(item.view.bearing_deg), "{:.0f}"),
    ("width [°]", lambda item: item.view.width_deg, "{:.1f}"),
    ("growth [°/s]", lambda item: item.growth_deg_s, "{:.1f}"),
    ("drift [°/s]", lambda item: abs(item.drift_deg_s), "{:.1f}"),
    ("pixels", lambda item: item.view.pixels, "{:.0f}"),
    ("contrast", lambda item: item.view.contrast, "{:.0f}"),
    ("visible for [s]", lambda item: item.seen_s, "{:.1f}"),
)
TARGETS = {"CC": "cars", "CM": "motorcycles", "CP": "pedestrians", "CB": "bicycles"}


def by_family(items: Iterable[Frontier | None]) -> dict[str, list[Frontier]]:
    """Return the frontiers of the cases with a contact, by family."""
    families: dict[str, list[Frontier]] = {}
    for item in items:
        if item is not None:
            families.setdefault(item.family, []).append(item)
    return families


def table(families: dict[str, list[Frontier]], camera: CameraParams) -> list[str]:
    """Return the lines of the table."""
    inside = [CameraParams.preset(name) for name in ("fovea", "wide")]
    heads = ["family", "cases", "avoidable", *(name for name, _, _ in COLUMNS)]
    heads[-3:-3] = [f"growth in `{camera.name}` [px/frame]", *(f"inside `{item.name}`" for item in inside)]
    lines = [heads, ["---"] * len(heads)]
    for family, items in families.items():
        cells = [text.format(median(map(value, items))) for _, value, text in COLUMNS]
        shares = [
            sum(abs(item.view.bearing_deg) < preset.hfov_deg / 2 for item in items) for preset in inside
        ]
        growth = median(item.growth_px(camera) for item in items)
        cells[-3:-3] = [f"{growth:.2f}", *(f"{share}/{len(items)}" for share in shares)]
        avoidable = sum(item.avoidable for item in items)
        lines.append([family, str(len(items)), f"{avoidable}/{len(items)}", *cells])
    return [f"| {' | '.join(line)} |" for line in lines]


def draw(families: dict[str, list[Frontier]], camera: CameraParams, path: Path) -> None:
    """Draw growth against bearing, one panel per kind of target and one point per case."""
    with saved_figure(path, 2, 2, sharex=True, sharey=True, figsize=(10, 8)) as (figure, panels):
        for (prefix, target), axes in zip(TARGETS.items(), panels.flat, strict=True):
            for family, items in families.items():
                if family.startswith(prefix):
                    bearings = [abs(item.view.bearing_deg) for item in items]
                    growths = [max(item.growth_px(camera), 0.02) for item in items]
                    axes.scatter(bearings, growths, s=14, alpha=0.7, label=family)
            axes.axvline(camera.hfov_deg / 2, color="grey", linestyle="--", linewidth=1)
            axes.axhline(1.0, color="grey", linestyle=":", linewidth=1)
            axes.set(title=target, yscale="log")
            if any(family.startswith(prefix) for family in families):
                axes.legend(frameon=False, fontsize=8, loc="lower right")
        edge = (camera.hfov_deg / 2, 0.04)
        panels[0, 0].annotate(f" edge of {camera.name}", edge, fontsize=8, color="grey")
        figure.supxlabel("bearing of the target's centre from the optical axis [°]")
        figure.supylabel(f"growth of the target's width in {camera.name} [px/frame]")
        figure.suptitle("The target at the last decision at which full braking avoids the contact")


def main() -> None:
    """Print the table and draw the figure."""
    parser = argparse.ArgumentParser(description="Frontier of the protocol suites")
    parser.add_argument("--suites", nargs="+", default=["ncap2023", "ncap2023-vru", "ncap2026"])
    parser.add_argument("--camera", default="wide", help="preset of the camera")
    parser.add_argument("--jobs", type=int, default=1, help="number of processes")
    parser.add_argument("--to", type=Path, help="picture to write")
    arguments = parser.parse_args()
    camera = CameraParams.preset(arguments.camera)
    cases = [case for name in arguments.suites for case in find_suite(name).cases]
    items = Parallel(n_jobs=arguments.jobs)(delayed(frontier)(case, camera) for case in cases)
    families = dict(sorted(by_family(items).items()))
    print("\n".join(table(families, camera)))
    if arguments.to:
        draw(families, camera, arguments.to)


if __name__ == "__main__":
    main()
